"""How wrong an arm's constants are, told by a swing about its tip.

All poses of a swing have their tip in one place. Wrong constants move it from pose to
pose in a few ways of their own, which the shaking of a hand does not have. How strongly
these ways are seen is compared with what is expected: a chi-square statistic that
points to the constants alone.
"""

import numpy as np
from numpy.typing import NDArray

from devices.microscribe.kinematics.arm_errors import ArmErrors
from devices.registration.consistency import Consistency
from devices.registration.pivot import PivotCalibration

# Per axis: the tip turns about no exact point of its hole.
TURNING_MM = 0.1

# More tell nothing new and take longer.
MOST_POSES = 60


def swing_consistency(errors: ArmErrors, pivot: PivotCalibration) -> Consistency:
    """Judge the constants behind ``errors`` by the poses of a pivot calibration.

    ``errors`` are those of the arm with the tip that was found. Raise UnreachableError
    for poses that the arm cannot have.
    """
    chosen = np.linspace(0, len(pivot.frames) - 1, MOST_POSES).astype(int)
    frames = pivot.frames[np.unique(chosen)].copy()
    count = len(frames)
    frames[:, :3, 3] += frames[:, :3, :3] @ pivot.tip_mm
    turning = np.broadcast_to(np.eye(3) * TURNING_MM**2, (count, 3, 3))
    found = errors.at(frames, np.eye(4), turning)
    whiten = np.linalg.inv(np.linalg.cholesky(found.noise))
    tips = frames[:, :3, :3]
    place = np.broadcast_to(np.eye(3), (count, 3, 3))
    # The tip is one of the shared causes, too; here it is fitted.
    unknown = _flat(whiten @ np.concatenate((tips, place), axis=2))
    if pivot.along_axis:
        unknown = unknown[:, 2:]
    causes = _flat(whiten @ found.common[..., : -len(errors.tip_mm)])
    off = _flat(whiten @ (frames[:, :3, 3] - pivot.point_mm)[..., None])[:, 0]
    fitted = np.linalg.qr(unknown)[0]
    off = off - fitted @ (fitted.T @ off)
    causes = causes - fitted @ (fitted.T @ causes)
    ways, strength, _ = np.linalg.svd(causes, full_matrices=False)
    # Where rounding and shaking hide a way, it says nothing of the constants.
    seen = strength > 1.0
    if not seen.any():
        return Consistency(0.0, 0)
    along = ways[:, seen].T @ off
    statistic = float(np.sum(along**2 / (1.0 + strength[seen] ** 2)))
    return Consistency(statistic, int(seen.sum()))


def _flat(blocks: NDArray[np.float64]) -> NDArray[np.float64]:
    return blocks.reshape(-1, blocks.shape[-1])
