"""Faults F19, F24, F26, F28 and F29: the arm and its client at odds."""

import random

from devices.microscribe.emulator.answer import Answer, AnswerKind
from devices.microscribe.emulator.emulated_arm import EmulatedArm
from devices.microscribe.emulator.faults.fault import EventFault, Fault, FaultyArm
from devices.microscribe.emulator.faults.schedule import Schedule
from devices.microscribe.emulator.firmware import FirmwareState
from devices.microscribe.emulator.packet import TICKS_PER_S

_PAUSE_S = 20.0
# The timer wraps this long after the fault.
_WRAP_IN_S = 1.0
_IGNORED_COMMANDS = 1
_MEMORY_COMMAND = 0xC7


class TimerWrap(EventFault):
    """F19."""

    id, word = "f19", "timer_wrap"
    line = (
        "the timer =WRAPs a second later, or the arm is deaf and dumb for 20 s: PAUSE"
    )
    variants = ("WRAP", "PAUSE")

    def __init__(self, schedule: Schedule, variant: str, noise: random.Random) -> None:
        super().__init__(schedule, variant, noise)
        self._deaf_until_s = 0.0

    kinds = frozenset((AnswerKind.PACKET,))

    def happen(self, arm: FaultyArm, now_s: float) -> None:
        """Set the timer forward, or be away."""
        if self.variant == "WRAP":
            left = (arm.profile.maxima.timer + 1) / TICKS_PER_S - _WRAP_IN_S
            arm.firmware.timer_zero_s = now_s - left
        else:
            self._deaf_until_s = now_s + _PAUSE_S

    def hear(self, data: bytes, arm: FaultyArm, now_s: float) -> bytes:
        """Hear nothing while away."""
        return b"" if now_s < self._deaf_until_s else data

    def answer(self, answer: Answer, arm: FaultyArm, now_s: float) -> list[Answer]:
        """Say nothing while away."""
        return [] if now_s < self._deaf_until_s else [answer]


class Unhomed(EventFault):
    """F24."""

    id, word = "f24", "unhomed"
    line = "questions are answered but no packets come until the Home button is pressed"

    def happen(self, arm: FaultyArm, now_s: float) -> None:
        """Measure nothing until the button is pressed."""
        arm.firmware.homed = False


class StreamGoesOn(Fault):
    """F26."""

    id, word = "f26", "stream_goes_on"
    line = "a stream does not stop at the first command (=N commands ignored, else 1)"
    takes_number = True
    lasts = True

    def __init__(self, schedule: Schedule, variant: str, noise: random.Random) -> None:
        super().__init__(schedule, variant, noise)
        self._left = 0

    def hear(self, data: bytes, arm: FaultyArm, now_s: float) -> bytes:
        """Lose what comes into a stream first."""
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
    """F28."""

    id, word = "f28", "loopback"
    line = "a bad cable: the host hears its own bytes and the arm none"
    lasts = True

    def hear(self, data: bytes, arm: FaultyArm, now_s: float) -> bytes:
        """Send the host's bytes back to it."""
        if not data or not self.trigger.fires(arm.script_s(now_s), arm.packets):
            return data
        self.fired += 1
        arm.send_foreign(data, now_s)
        return b""


class MemoryWrite(EventFault):
    """F29."""

    id, word = "f29", "memory_write"
    line = "somebody else on the line tries to rewrite the calibration memory"

    def tick(self, arm: FaultyArm, now_s: float) -> None:
        """Wait for a session: outside of one nothing that is said is a command."""
        if arm.firmware.state in (FirmwareState.IDLE, FirmwareState.MOTION):
            super().tick(arm, now_s)

    def happen(self, arm: FaultyArm, now_s: float) -> None:
        """Let the arm hear the command and its password."""
        serial = arm.profile.identity.serial.encode()
        assert isinstance(arm, EmulatedArm)
        arm.hear(bytes((_MEMORY_COMMAND,)) + serial + b"\0", now_s)
