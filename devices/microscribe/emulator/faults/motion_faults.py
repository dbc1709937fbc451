"""Faults F18, F25 and F27: what the arm measures."""

import math
import random

from devices.microscribe.emulator.faults.fault import EventFault, Fault, FaultyArm
from devices.microscribe.emulator.faults.schedule import Schedule
from devices.microscribe.emulator.firmware import FarState
from devices.microscribe.kinematics.arm import FIELD

# All 16384 counts up and down again in this time: the quickest joint, a roll encoder
# of 2000 counts, then turns at 620 degrees per second, which a hand can do.
_SWEEP_S = 30.0

_PRESSED_S = 0.3
_BOUNCES = 4
_SHORTEST_BOUNCE_S, _LONGEST_BOUNCE_S = 0.002, 0.010
_RIGHT, _BOTH = 1, 3

_MOST_MISSED = 5


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
        built_in = arm.built_in_encoders
        swept = (
            (count + turned) % FIELD if i in built_in else count
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
        if self._armed and data and arm.far_end.state is FarState.MOTION:
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


class SickEncoder(Fault):
    """F27."""

    id, word = "f27", "sick_encoder"
    line = "an encoder DEAD, with MISSED counts, or BACKWARDS (=DEAD2: number 2)"
    variants = tuple(
        f"{illness}{joint}"
        for joint in (2, 0, 1, 3, 4, 5)
        for illness in ("DEAD", "MISSED", "BACKWARDS")
    )
    lasts = True

    def __init__(self, schedule: Schedule, variant: str, noise: random.Random) -> None:
        # Without a number it is the elbow's.
        if variant and not variant[-1].isdigit():
            variant += "2"
        super().__init__(schedule, variant, noise)
        self._joint = int(self.variant[-1])
        self._illness = self.variant[:-1]
        self._at_onset: int | None = None
        self._missed = 0

    def latch(
        self, counts: tuple[int, ...], buttons: int, arm: FaultyArm, now_s: float
    ) -> tuple[tuple[int, ...], int]:
        """Read one joint wrongly."""
        true = counts[self._joint]
        if self.trigger.fires(arm.script_s(now_s), arm.packets + 1):
            self.fired += 1
            if self._at_onset is None:
                self._at_onset = true
            self._missed += self.noise.randint(1, _MOST_MISSED)
        elif self._illness != "MISSED":
            self._at_onset = None
        read = true
        if self._illness == "MISSED":
            # What was missed once stays missing.
            read = true - self._missed
        elif self._at_onset is not None:
            turned = true - self._at_onset
            read = self._at_onset - (turned if self._illness == "BACKWARDS" else 0)
        sick = list(counts)
        sick[self._joint] = read % FIELD
        return tuple(sick), buttons
