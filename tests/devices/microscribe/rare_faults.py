"""The rare ones of the protocol's thirty faults, and all of them together."""

import math
import random
from collections.abc import Sequence
from dataclasses import replace

from devices.microscribe.emulator.answer import Answer, AnswerKind
from devices.microscribe.emulator.emulated_arm import EmulatedArm
from devices.microscribe.emulator.faults.catalogue import FAULTS, FaultPlan, parse_fault
from devices.microscribe.emulator.faults.fault import EVERY_KIND, EventFault, Fault
from devices.microscribe.emulator.faults.schedule import Schedule
from devices.microscribe.emulator.firmware import ArmFirmware, FirmwareState
from devices.microscribe.emulator.packet import TICKS_PER_S
from devices.microscribe.kinematics.arm import FIELD
from devices.microscribe.kinematics.profiles import ArmProfile
from system import UserError

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
    id, word = "f2", "one_rate"
    lasts = True
    takes_number = True

    def listening_rate(
        self, client_rate: int, arm: EmulatedArm, now_s: float
    ) -> int | None:
        rate = int(self.number(_ONE_RATE))
        return self.insist_on(rate, client_rate, arm, now_s)


class SurplusEchoes(Fault):
    id, word = "f3", "surplus_echoes"
    takes_number = True
    kinds = frozenset((AnswerKind.ATTENTION, AnswerKind.PRODUCT_ID))

    def __init__(self, schedule: Schedule, variant: str, noise: random.Random) -> None:
        super().__init__(schedule, variant, noise)
        self._count = int(self.number(_SURPLUS))
        if not 1 <= self._count <= _MOST_SURPLUS:
            raise UserError(f"f3 sends 1 to 20 surplus echoes, got {variant}")
        self._owed = 0

    def answer(self, answer: Answer, arm: EmulatedArm, now_s: float) -> list[Answer]:
        if answer.kind is AnswerKind.PRODUCT_ID and self._owed:
            echo = Answer(AnswerKind.ATTENTION, b"IMMC")
            owed, self._owed = self._owed, 0
            return [*[echo] * owed, answer]
        if answer.kind is not AnswerKind.ATTENTION:
            return [answer]
        return super().answer(answer, arm, now_s)

    def spoil(self, answer: Answer, arm: EmulatedArm, now_s: float) -> list[Answer]:
        self._owed = self._count // 2
        return [answer] * (1 + self._count - self._owed)


class EndEcho(Fault):
    id, word = "f4", "end_echo"
    kinds = frozenset((AnswerKind.ATTENTION,))

    def spoil(self, answer: Answer, arm: EmulatedArm, now_s: float) -> list[Answer]:
        return [Answer(AnswerKind.ECHO, b"\xc5"), answer]


class NoBegin(Fault):
    id, word = "f5", "no_begin"
    lasts = True
    kinds = frozenset((AnswerKind.PRODUCT_ID,))

    def spoil(self, answer: Answer, arm: EmulatedArm, now_s: float) -> list[Answer]:
        arm.firmware.state = FirmwareState.SYNC
        arm.firmware.answers(b"IMMC", now_s)
        return []


class WrongId(Fault):
    id, word = "f6", "wrong_id"
    variants = ("IBOX", "XXXX", "EMPTY")
    lasts = True
    kinds = frozenset((AnswerKind.PRODUCT_ID,))

    def spoil(self, answer: Answer, arm: EmulatedArm, now_s: float) -> list[Answer]:
        word = b"" if self.variant == "EMPTY" else self.variant.encode()
        return [replace(answer, data=word + b"\0")]


class LeftOpen(EventFault):
    id, word = "f7", "left_open"
    variants = ("RUN", "MOTION", "ARGS", "PASSWORD")

    def happen(self, arm: EmulatedArm, now_s: float) -> None:
        leave_session(arm.firmware, self.variant, now_s)


_PACKETS = frozenset((AnswerKind.PACKET,))
_TOP_BIT = 0x80


class DoubledByte(Fault):
    id, word = "f9", "doubled_byte"
    takes_number = True
    kinds = _PACKETS

    def spoil(self, answer: Answer, arm: EmulatedArm, now_s: float) -> list[Answer]:
        at = _position(self, answer.data)
        return [replace(answer, data=answer.data[: at + 1] + answer.data[at:])]


class WrongTopBit(Fault):
    id, word = "f11", "wrong_top_bit"
    variants = ("PAYLOAD", "HEADER")
    kinds = _PACKETS

    def spoil(self, answer: Answer, arm: EmulatedArm, now_s: float) -> list[Answer]:
        data = bytearray(answer.data)
        header = self.variant == "HEADER"
        data[0 if header else self.noise.randrange(1, len(data))] ^= _TOP_BIT
        return [replace(answer, data=bytes(data))]


def _position(fault: Fault, data: bytes) -> int:
    if fault.variant:
        return min(int(fault.number(0)), len(data) - 1)
    return fault.noise.randrange(len(data))


_LONGEST_GAP_MS = 50.0


class Chunks(Fault):
    id, word = "f13", "chunks"
    wire_order = 3
    takes_number = True
    lasts = True
    kinds = EVERY_KIND

    def spoil(self, answer: Answer, arm: EmulatedArm, now_s: float) -> list[Answer]:
        longest_s = self.number(_LONGEST_GAP_MS) / 1e3
        pieces: list[Answer] = []
        at, left_s = 0, longest_s
        while at < len(answer.data):
            size = self.noise.choice((1, 1, 2, 5))
            gap_s = self.noise.uniform(0.0, left_s)
            left_s -= gap_s
            piece = answer.data[at : at + size]
            pieces.append(replace(answer, data=piece, delay_s=gap_s, after=None))
            at += size
        if not pieces:
            return [answer]
        first, last = pieces[0], pieces[-1]
        pieces[0] = replace(first, delay_s=first.delay_s + answer.delay_s)
        pieces[-1] = replace(pieces[-1], after=answer.after) if last else last
        return pieces


# All 16384 counts up and down again in this time: the quickest joint, a roll encoder
# of 2000 counts, then turns at 620 degrees per second, which a hand can do.
_SWEEP_S = 30.0

_PRESSED_S = 0.3
_BOUNCES = 4
_SHORTEST_BOUNCE_S, _LONGEST_BOUNCE_S = 0.002, 0.010
_RIGHT, _BOTH = 1, 3


class EncoderWrap(Fault):
    id, word = "f18", "encoder_wrap"
    lasts = True
    _began_s: float | None = None

    def latch(
        self, counts: tuple[int, ...], buttons: int, arm: EmulatedArm, now_s: float
    ) -> tuple[tuple[int, ...], int]:
        if not self.trigger.fires(arm.script_s(now_s), arm.packets + 1):
            self._began_s = None
            return counts, buttons
        if self._began_s is None:
            self._began_s = now_s
            self.fired += 1
        phase = 2.0 * math.pi * (now_s - self._began_s) / _SWEEP_S
        turned = round(FIELD * math.sin(phase))
        maxima = arm.profile.maxima.encoders
        swept = (
            (count + turned) % FIELD if maxima[i] else count
            for i, count in enumerate(counts)
        )
        return tuple(swept), buttons


class Pedals(EventFault):
    id, word = "f25", "pedals"
    variants = ("BOUNCE", "BOTH", "STOPS")
    _edges: Sequence[float] = ()
    _armed = False

    def happen(self, arm: EmulatedArm, now_s: float) -> None:
        if self.variant == "STOPS":
            # It happens when the stream is stopped, if ever.
            self._armed = True
            self.fired -= 1
        else:
            self._press(now_s)

    def hear(self, data: bytes, arm: EmulatedArm, now_s: float) -> bytes:
        if self._armed and data and arm.firmware.state is FirmwareState.MOTION:
            self._armed = False
            self.fired += 1
            self._press(now_s)
        return data

    def latch(
        self, counts: tuple[int, ...], buttons: int, arm: EmulatedArm, now_s: float
    ) -> tuple[tuple[int, ...], int]:
        passed = sum(1 for edge in self._edges if edge <= now_s)
        mask = _BOTH if self.variant == "BOTH" else _RIGHT
        return counts, buttons | (mask if passed % 2 else 0)

    def _press(self, now_s: float) -> None:
        bounces = _BOUNCES if self.variant == "BOUNCE" else 0
        self._edges = [
            *self._contact(now_s, bounces),
            *self._contact(now_s + _PRESSED_S, bounces),
        ]

    def _contact(self, at_s: float, bounces: int) -> list[float]:
        edges = [at_s]
        for _ in range(bounces):
            pause = self.noise.uniform(_SHORTEST_BOUNCE_S, _LONGEST_BOUNCE_S)
            edges.append(edges[-1] + pause)
        return edges


_PAUSE_S = 20.0
# The timer wraps this long after the fault.
_WRAP_IN_S = 1.0
_IGNORED_COMMANDS = 1
_MEMORY_COMMAND = 0xC7


class TimerWrap(EventFault):
    id, word = "f19", "timer_wrap"
    variants = ("WRAP", "PAUSE")
    _deaf_until_s = 0.0

    kinds = frozenset((AnswerKind.PACKET,))

    def happen(self, arm: EmulatedArm, now_s: float) -> None:
        if self.variant == "WRAP":
            left = (arm.profile.maxima.timer + 1) / TICKS_PER_S - _WRAP_IN_S
            arm.firmware.timer_zero_s = now_s - left
        else:
            self._deaf_until_s = now_s + _PAUSE_S

    def hear(self, data: bytes, arm: EmulatedArm, now_s: float) -> bytes:
        return b"" if now_s < self._deaf_until_s else data

    def answer(self, answer: Answer, arm: EmulatedArm, now_s: float) -> list[Answer]:
        return [] if now_s < self._deaf_until_s else [answer]


class Unhomed(EventFault):
    id, word = "f24", "unhomed"

    def happen(self, arm: EmulatedArm, now_s: float) -> None:
        arm.firmware.homed = False


class StreamGoesOn(Fault):
    id, word = "f26", "stream_goes_on"
    takes_number = True
    lasts = True
    _left = 0

    def hear(self, data: bytes, arm: EmulatedArm, now_s: float) -> bytes:
        if arm.firmware.state is not FirmwareState.MOTION:
            self._left = int(self.number(_IGNORED_COMMANDS))
            return data
        if not data or not self.trigger.fires(arm.script_s(now_s), arm.packets):
            return data
        lost = min(self._left, len(data))
        self._left -= lost
        self.fired += lost > 0
        return data[lost:]


class Loopback(Fault):
    id, word = "f28", "loopback"
    lasts = True

    def hear(self, data: bytes, arm: EmulatedArm, now_s: float) -> bytes:
        if not data or not self.trigger.fires(arm.script_s(now_s), arm.packets):
            return data
        self.fired += 1
        arm.send_foreign(data, now_s)
        return b""


class MemoryWrite(EventFault):
    id, word = "f29", "memory_write"

    def tick(self, arm: EmulatedArm, now_s: float) -> None:
        if arm.firmware.state in (FirmwareState.IDLE, FirmwareState.MOTION):
            super().tick(arm, now_s)

    def happen(self, arm: EmulatedArm, now_s: float) -> None:
        serial = arm.profile.identity.serial.encode()
        arm.hear(bytes((_MEMORY_COMMAND,)) + serial + b"\0", now_s)


_COMMENT, _FORMAT = 0xCC, 0xCD
_LONG = 40

# Encoders of 16000, 8000 and 4000 counts a turn are known of a USB sibling.
_ODD_ENCODERS = (15999, 15999, 7999, 3999, 3999)


class BadString(Fault):
    id, word = "f20", "bad_string"
    variants = ("NO_NUL", "LONG", "NON_ASCII", "EMPTY")
    kinds = frozenset((AnswerKind.STRING,))

    def spoil(self, answer: Answer, arm: EmulatedArm, now_s: float) -> list[Answer]:
        echo, text = answer.data[:1], answer.data[1:-1]
        body = {
            "NO_NUL": text,
            "LONG": (text + b"x" * _LONG)[:_LONG] + b"\0",
            "NON_ASCII": b"\xe9" + text[1:] + b"\0",
            "EMPTY": b"\0",
        }[self.variant]
        return [replace(answer, data=echo + body)]


class BadParameters(Fault):
    id, word = "f21", "bad_parameters"
    variants = ("35", "0", "37", "255", "FORMAT")
    lasts = True
    kinds = frozenset((AnswerKind.PARAMETERS, AnswerKind.STRING))

    def spoil(self, answer: Answer, arm: EmulatedArm, now_s: float) -> list[Answer]:
        code = answer.data[0]
        if self.variant == "FORMAT":
            known = answer.kind is not AnswerKind.STRING or code != _FORMAT
            return [answer if known else replace(answer, data=b"\xcdFormat DH9.9\0")]
        if answer.kind is not AnswerKind.PARAMETERS:
            return [answer]
        length = int(self.variant)
        block = (answer.data[2:] + bytes(length))[:length]
        return [replace(answer, data=bytes((code, length)) + block)]


class BadMaxima(Fault):
    id, word = "f22", "bad_maxima"
    variants = ("ZERO", "ODD")
    lasts = True
    kinds = frozenset((AnswerKind.MAXIMA,))

    def __init__(self, schedule: Schedule, variant: str, noise: random.Random) -> None:
        super().__init__(schedule, variant, noise)
        if self.variant == "ODD" and schedule != Schedule():
            raise UserError(
                "f22_bad_maxima=ODD gives the arm other encoders, which it has from "
                "the start; write it without a moment"
            )

    def alter(self, profile: ArmProfile) -> ArmProfile:
        if self.variant != "ODD":
            return profile
        encoders = (*_ODD_ENCODERS, profile.maxima.encoders[5])
        return replace(profile, maxima=replace(profile.maxima, encoders=encoders))

    def spoil(self, answer: Answer, arm: EmulatedArm, now_s: float) -> list[Answer]:
        if self.variant == "ODD":
            # The profile was altered already: what leaves the arm is what it has.
            self.fired += 1
            return [answer]
        return [replace(answer, data=answer.data[:1] + bytes(len(answer.data) - 1))]


class SilentBeta(Fault):
    id, word = "f23", "silent_beta"
    variants = ("BETA", "STANDARD")
    lasts = True
    kinds = frozenset((AnswerKind.EXTENDED, AnswerKind.STRING))

    def spoil(self, answer: Answer, arm: EmulatedArm, now_s: float) -> list[Answer]:
        if answer.kind is AnswerKind.EXTENDED:
            return []
        if answer.data[0] == _COMMENT and self.variant == "STANDARD":
            return [replace(answer, data=b"\xccStandard\0")]
        if answer.data[0] == _COMMENT and b"Beta" not in answer.data:
            return [replace(answer, data=b"\xccStandard+Beta\0")]
        return [answer]


RARE_FAULTS = (
    OneRate,
    SurplusEchoes,
    EndEcho,
    NoBegin,
    WrongId,
    LeftOpen,
    DoubledByte,
    WrongTopBit,
    Chunks,
    EncoderWrap,
    TimerWrap,
    BadString,
    BadParameters,
    BadMaxima,
    SilentBeta,
    Unhomed,
    Pedals,
    StreamGoesOn,
    Loopback,
    MemoryWrite,
)

EVERY_FAULT: tuple[type[Fault], ...] = (*FAULTS, *RARE_FAULTS)


def parse_any_fault(text: str) -> FaultPlan:
    """Read a fault of the product or a rare one."""
    return parse_fault(text, EVERY_FAULT)
