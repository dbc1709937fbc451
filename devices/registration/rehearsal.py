"""How a person registers an arm, as a path: turn in a hole, touch, trace.

For the emulated arm, which has nobody to hold it. The path's right pedal is down
exactly while something is to be measured.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices.recording.probe_path import ProbePath

MEASURE_PEDAL = 1

# Posterior: an arm beside a supine patient points its stylus down at the face.
DOWN = np.array([0.0, 1.0, 0.0])
AWAY = -DOWN

STEP_S = 0.02
TRAVEL_S = 0.7
LIFT_MM = 25.0
SETTLE_S = 0.15
HOLD_S = 0.8
TURN_S = 8.0
TURNS = 5
HALF_CONE_DEG = 30.0
TRACE_MM_S = 40.0

# Physiological tremor, 8-12 Hz.
TREMOR_HZ = (8.3, 9.7, 11.4)


@dataclass(frozen=True, slots=True)
class Hand:
    """How well a hand holds a stylus; mm, rms length of each error."""

    tremor_mm: float = 0.1
    seat_mm: float = 0.25
    """Off the middle of the hole into which the tip is put, anew for each touch."""


@dataclass(slots=True)
class _Script:
    """Samples of the path as they grow."""

    tips: list[NDArray[np.float64]]
    axes: list[NDArray[np.float64]]
    pedals: list[int]

    def add(
        self, tips: NDArray[np.float64], axes: NDArray[np.float64], pedal: int
    ) -> None:
        self.tips += list(tips)
        self.axes += list(np.broadcast_to(axes, tips.shape))
        self.pedals += [pedal] * len(tips)

    def travel(self, tip: NDArray[np.float64], axis: NDArray[np.float64]) -> None:
        """Lift off, go over, come down; minimum jerk."""
        u = np.linspace(0.0, 1.0, round(TRAVEL_S / STEP_S))[1:, None]
        blend = u**3 * (10.0 - 15.0 * u + 6.0 * u**2)
        over = self.tips[-1] + blend * (tip - self.tips[-1])
        lifted = over + LIFT_MM * 4.0 * blend * (1.0 - blend) * AWAY
        turned = self.axes[-1] + blend * (axis - self.axes[-1])
        self.add(lifted, turned / np.linalg.norm(turned, axis=1, keepdims=True), 0)

    def rest(self, seconds: float, pedal: int) -> None:
        count = round(seconds / STEP_S)
        self.add(np.tile(self.tips[-1], (count, 1)), self.axes[-1], pedal)


def rehearse(
    landmarks_mm: NDArray[np.float64],
    *,
    pivot_mm: NDArray[np.float64] | None = None,
    traced_mm: NDArray[np.float64] | None = None,
    hand: Hand | None = None,
    seed: int = 0,
) -> ProbePath:
    """Return the path of a registration, patient LPS.

    ``landmarks_mm`` (n, 3) are touched in order, after the stylus has been turned in
    a hole at ``pivot_mm`` (3,); at last ``traced_mm`` (m, 3) are followed in order:
    where the tip is, which lies in the skin that it dents.
    """
    person = hand or Hand()
    rng = np.random.default_rng(seed)
    begin = landmarks_mm[0] if pivot_mm is None else pivot_mm
    script = _Script([begin + LIFT_MM * AWAY], [DOWN], [0])
    if pivot_mm is not None:
        _turn(script, pivot_mm)
    for landmark in landmarks_mm:
        seat = rng.normal(size=3) * person.seat_mm / math.sqrt(3.0)
        script.travel(landmark + seat, DOWN)
        script.rest(SETTLE_S, 0)
        script.rest(HOLD_S, MEASURE_PEDAL)
        script.rest(SETTLE_S, 0)
    if traced_mm is not None and len(traced_mm):
        _trace(script, traced_mm)
    script.travel(begin + LIFT_MM * AWAY, DOWN)
    return _as_path(script, person, rng)


def _turn(script: _Script, hole: NDArray[np.float64]) -> None:
    script.travel(hole, DOWN)
    script.rest(SETTLE_S, 0)
    u = np.linspace(0.0, 1.0, round(TURN_S / STEP_S))
    # The radius of a spiral that spends equal times on equal areas of the cone.
    tilt = np.radians(HALF_CONE_DEG) * np.sqrt(np.minimum(1.0, 4.0 * u * (1.0 - u)))
    around = 2.0 * np.pi * TURNS * u
    side = np.sin(tilt)
    axes = np.stack((side * np.cos(around), np.cos(tilt), side * np.sin(around)), 1)
    script.add(np.tile(hole, (len(u), 1)), axes, MEASURE_PEDAL)
    script.rest(SETTLE_S, 0)


def _trace(script: _Script, traced: NDArray[np.float64]) -> None:
    script.travel(traced[0], DOWN)
    script.rest(SETTLE_S, 0)
    along = np.concatenate(
        ([0.0], np.cumsum(np.linalg.norm(np.diff(traced, axis=0), axis=1)))
    )
    at = np.arange(0.0, along[-1], TRACE_MM_S * STEP_S)
    tips = np.stack([np.interp(at, along, traced[:, k]) for k in range(3)], axis=1)
    script.add(tips, script.axes[-1], MEASURE_PEDAL)
    script.rest(SETTLE_S, 0)


def _as_path(script: _Script, hand: Hand, rng: np.random.Generator) -> ProbePath:
    count = len(script.tips)
    t_s = STEP_S * np.arange(count, dtype=np.float64)
    phases = rng.uniform(0.0, 2.0 * np.pi, (3, 3))
    waves = np.sin(
        2.0 * np.pi * t_s[:, None, None] * np.array(TREMOR_HZ)[:, None] + phases
    )
    # Three sines of this amplitude on three axes have the wanted rms length.
    shake = hand.tremor_mm * math.sqrt(2.0 / 9.0) * waves.sum(axis=1)
    tips, axes = np.array(script.tips) + shake, np.array(script.axes)
    return ProbePath(
        name="registration",
        t_s=t_s,
        tip_mm=tips,
        axis=axes,
        roll_deg=np.zeros(count),
        instrument_tip_mm=tips,
        instrument_axis=axes,
        buttons=np.array(script.pedals, dtype=np.int64),
    )
