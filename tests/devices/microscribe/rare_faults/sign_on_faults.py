"""Faults F2 to F7: before a session is open."""

import random
from dataclasses import replace

from devices.microscribe.emulator.answer import Answer, AnswerKind
from devices.microscribe.emulator.faults.fault import (
    EventFault,
    Fault,
    FaultyArm,
)
from devices.microscribe.emulator.faults.schedule import Schedule
from devices.microscribe.emulator.firmware import ArmFirmware, FirmwareState
from disk import UserError

_SURPLUS = 5
_MOST_SURPLUS = 20
_ONE_RATE = 19200

# What a host sends after its sign-on and before it dies.
_LEFT_IN = {
    "RUN": b"",
    "MOTION": b"\xcf\x00\x09\x23" + bytes(21),
    "ARGS": b"\xcf",
    "PASSWORD": b"\xc7",
}


def leave_session(firmware: ArmFirmware, where: str, now_s: float) -> None:
    """Let a host sign on, go as far as ``where`` and die."""
    writes, firmware.state = firmware.memory_writes, FirmwareState.SYNC
    firmware.answers(b"IMMC" * _MOST_SURPLUS + b"BEGIN" + _LEFT_IN[where], now_s)
    firmware.memory_writes = writes


class OneRate(Fault):
    """F2."""

    id, word = "f2", "one_rate"
    line = "signs on at one rate of seven only (=BAUD, else 19200)"
    lasts = True
    takes_number = True

    def listening_rate(
        self, client_rate: int, arm: FaultyArm, now_s: float
    ) -> int | None:
        """Return that rate."""
        rate = int(self.number(_ONE_RATE))
        return self.insist_on(rate, client_rate, arm, now_s)


class SurplusEchoes(Fault):
    """F3."""

    id, word = "f3", "surplus_echoes"
    line = "up to 20 more IMMC echoes, half of them after BEGIN was sent (=N, else 5)"
    takes_number = True
    kinds = frozenset((AnswerKind.ATTENTION, AnswerKind.PRODUCT_ID))

    def __init__(self, schedule: Schedule, variant: str, noise: random.Random) -> None:
        super().__init__(schedule, variant, noise)
        self._count = int(self.number(_SURPLUS))
        if not 1 <= self._count <= _MOST_SURPLUS:
            raise UserError(f"f3 sends 1 to 20 surplus echoes, got {variant}")
        self._owed = 0

    def answer(self, answer: Answer, arm: FaultyArm, now_s: float) -> list[Answer]:
        """Hold the echoes back that belong in front of the product id."""
        if answer.kind is AnswerKind.PRODUCT_ID and self._owed:
            echo = Answer(AnswerKind.ATTENTION, b"IMMC")
            owed, self._owed = self._owed, 0
            return [*[echo] * owed, answer]
        if answer.kind is not AnswerKind.ATTENTION:
            return [answer]
        return super().answer(answer, arm, now_s)

    def spoil(self, answer: Answer, arm: FaultyArm, now_s: float) -> list[Answer]:
        """Repeat the echo at once, and owe the rest."""
        self._owed = self._count // 2
        return [answer] * (1 + self._count - self._owed)


class EndEcho(Fault):
    """F4."""

    id, word = "f4", "end_echo"
    line = "C5 in front of the first IMMC echo, as of a session left open"
    kinds = frozenset((AnswerKind.ATTENTION,))

    def spoil(self, answer: Answer, arm: FaultyArm, now_s: float) -> list[Answer]:
        """Put the echo of END in front."""
        return [Answer(AnswerKind.ECHO, b"\xc5"), answer]


class NoBegin(Fault):
    """F5."""

    id, word = "f5", "no_begin"
    line = "IMMC is echoed but BEGIN never answered"
    lasts = True
    kinds = frozenset((AnswerKind.PRODUCT_ID,))

    def spoil(self, answer: Answer, arm: FaultyArm, now_s: float) -> list[Answer]:
        """Be as if BEGIN had not been understood."""
        arm.firmware.state = FirmwareState.SYNC
        arm.firmware.answers(b"IMMC", now_s)
        return []


class WrongId(Fault):
    """F6."""

    id, word = "f6", "wrong_id"
    line = "another product id after BEGIN (=IBOX, XXXX or EMPTY)"
    variants = ("IBOX", "XXXX", "EMPTY")
    lasts = True
    kinds = frozenset((AnswerKind.PRODUCT_ID,))

    def spoil(self, answer: Answer, arm: FaultyArm, now_s: float) -> list[Answer]:
        """Be somebody else."""
        word = b"" if self.variant == "EMPTY" else self.variant.encode()
        return [replace(answer, data=word + b"\0")]


class LeftOpen(EventFault):
    """F7."""

    id, word = "f7", "left_open"
    line = "a dead host left its session in =RUN, MOTION, ARGS or PASSWORD"
    variants = ("RUN", "MOTION", "ARGS", "PASSWORD")

    def happen(self, arm: FaultyArm, now_s: float) -> None:
        """Be in the middle of somebody's session."""
        leave_session(arm.firmware, self.variant, now_s)
