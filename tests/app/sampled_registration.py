"""A registration as an emulated hand makes it, from few samples of its path.

The same hand, metal, rounding and fit as over the wire, in half a second.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from devices.microscribe.kinematics.uncertainty import ParameterSpread
from devices.microscribe.wire.link import ArmDescription
from devices.registration.held_point import HeldPoint
from devices.registration.pivot import calibrate_pivot
from devices.registration.rehearsal import rehearse
from paravol.registration.fit import DENT_MM, Touched
from paravol.registration.rehearsed_arm import RehearsedTruth, rehearsed_truth
from paravol.registration.skin import Skin

SWING_POSES = 110
HOLD_STRIDE = 3


@dataclass
class Sampled:
    """What was measured, what the arm says of itself and what is true."""

    touched: Touched
    arm: ArmDescription
    truth: RehearsedTruth


def sampled_registration(
    landmarks: dict[str, NDArray[np.float64]],
    seed: int,
    *,
    skin: Skin | None = None,
    pivot: bool = True,
    words: tuple[int, ...] | None = None,
    spread: ParameterSpread | None = None,
    slip: tuple[int, NDArray[np.float64]] | None = None,
) -> Sampled:
    """Register once.

    ``words`` are the constants that the arm states instead of its own; ``slip`` is a
    landmark that was touched beside its place, and by how much (3,).
    """
    points = np.stack(list(landmarks.values()))
    if slip is not None:
        points[slip[0]] += slip[1]
    path = rehearse(
        points,
        pivot_mm=points[0] if pivot else None,
        traced_mm=None if skin is None else skin.raster(DENT_MM),
        seed=seed,
    )
    truth = rehearsed_truth(path, spread or ParameterSpread(), seed)
    if words is not None:
        truth = replace(truth, profile=replace(truth.profile, dh_words=words))
    stated, encoders = truth.profile.geometry, truth.profile.encoders
    turn, shift = truth.device_from_world[:3, :3], truth.device_from_world[:3, 3]
    down = np.concatenate(([0], path.buttons & 1, [0]))
    begins = np.flatnonzero(np.diff(down) == 1).tolist()
    ends = np.flatnonzero(np.diff(down) == -1).tolist()
    angles = truth.held_angles

    def frames(samples: NDArray[np.int64]) -> NDArray[np.float64]:
        nonlocal angles
        found = []
        for i in samples.tolist():
            tip = turn @ path.tip_mm[i] + shift
            angles = truth.built.angles(tip, turn @ path.axis[i], angles)
            read = encoders.angles(encoders.counts(angles))
            found.append(stated.device_from_tip(read))
        return np.array(found)

    calibrated = None
    if pivot:
        swing = np.linspace(begins.pop(0), ends.pop(0) - 1, SWING_POSES)
        calibrated = calibrate_pivot(frames(swing.astype(np.int64)), along_axis=True)
    tip_mm = np.zeros(3) if calibrated is None else calibrated.tip_mm

    def on_tip(found: NDArray[np.float64]) -> NDArray[np.float64]:
        found[:, :3, 3] += found[:, :3, :3] @ tip_mm
        return found

    held = []
    for begin, end in zip(begins[: len(points)], ends, strict=False):
        cut = (end - begin) // 5
        held.append(_held(on_tip(frames(np.arange(begin + cut, end - cut, 3)))))
    traced = np.zeros((0, 3))
    if skin is not None:
        trace = np.arange(begins[-1], ends[-1], HOLD_STRIDE)
        traced = on_tip(frames(trace))[:, :3, 3]
    arm = ArmDescription(truth.profile.identity, truth.profile.maxima, stated)
    return Sampled(Touched(held, traced, calibrated), arm, truth)


def _held(frames: NDArray[np.float64]) -> HeldPoint:
    tips = frames[:, :3, 3]
    mean = tips.mean(axis=0)
    frame = frames[len(frames) // 2].copy()
    frame[:3, 3] = mean
    shake = float(np.sqrt(np.mean(np.sum((tips - mean) ** 2, axis=1))))
    # half a second of a tremor of ten hertz
    noise: NDArray[np.float64] = np.cov(tips.T) / 6.0
    return HeldPoint(frame, shake, noise)
