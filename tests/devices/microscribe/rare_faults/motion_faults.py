"""Faults F18 and F25: what the arm measures."""

import math
import random

from devices.microscribe.emulator.faults.fault import EventFault, Fault, FaultyArm
from devices.microscribe.emulator.faults.schedule import Schedule
from devices.microscribe.emulator.firmware import FirmwareState
from devices.microscribe.kinematics.arm import FIELD

# All 16384 counts up and down again in this time: the quickest joint, a roll encoder
# of 2000 counts, then turns at 620 degrees per second, which a hand can do.
_SWEEP_S = 30.0

_PRESSED_S = 0.3
_BOUNCES = 4
_SHORTEST_BOUNCE_S, _LONGEST_BOUNCE_S = 0.002, 0.010
_RIGHT, _BOTH = 1, 3


class EncoderWrap(Fault):
    """F18."""

    id, word = "f18", "encoder_wrap"
    line = "every encoder runs through its whole field, up and down, winding bits too"
    lasts = True

    def __init__(self, schedule: Schedule, variant: str, noise: random.Random) -> None:
        super().__init__(schedule, variant, noise)
        self._began_s: float | None = None

    def latch(
        self, counts: tuple[int, ...], buttons: int, arm: FaultyArm, now_s: float
    ) -> tuple[tuple[int, ...], int]:
        """Turn every joint from where it stands, and back."""
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
    """F25."""

    id, word = "f25", "pedals"
    line = "a pedal that =BOUNCEs, BOTH at once, or one pressed as a stream STOPS"
    variants = ("BOUNCE", "BOTH", "STOPS")

    def __init__(self, schedule: Schedule, variant: str, noise: random.Random) -> None:
        super().__init__(schedule, variant, noise)
        self._edges: list[float] = []
        self._armed = False

    def happen(self, arm: FaultyArm, now_s: float) -> None:
        """Press, or wait for the stream to be stopped."""
        if self.variant == "STOPS":
            # It happens when the stream is stopped, if ever.
            self._armed = True
            self.fired -= 1
        else:
            self._press(now_s)

    def hear(self, data: bytes, arm: FaultyArm, now_s: float) -> bytes:
        """Press when a command comes into a stream."""
        if self._armed and data and arm.firmware.state is FirmwareState.MOTION:
            self._armed = False
            self.fired += 1
            self._press(now_s)
        return data

    def latch(
        self, counts: tuple[int, ...], buttons: int, arm: FaultyArm, now_s: float
    ) -> tuple[tuple[int, ...], int]:
        """Add the pedal to what is pressed."""
        passed = sum(1 for edge in self._edges if edge <= now_s)
        mask = _BOTH if self.variant == "BOTH" else _RIGHT
        return counts, buttons | (mask if passed % 2 else 0)

    def _press(self, now_s: float) -> None:
        """Plan the edges: contact, bounces, and the same when it is let go."""
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
