"""Where the tip of a tool is: turn it about a point at which the tip rests.

Every pose puts the tip t, fixed in the tool, on the same point c of the device's frame,
R_i t + p_i = c: linear least squares in t and c. How well t comes out depends on how
far the tool was turned and not on how well the poses agree, so that the condition of
the system is judged and the residual is not taken for accuracy.
"""

from dataclasses import dataclass, replace
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from devices.pose import Pose
from system import UserError

FEWEST_POSES = 100

# 20 is reached by poses spread over a cone of 12 degrees half angle; the tip is then
# uncertain by 1.5 times the noise of one pose, at 100 poses.
LARGEST_CONDITION = 20.0

# Per axis. Users of a real arm measured 0.38 mm; twice the noise is refused.
NOISE_MM = 0.2
LARGEST_RESIDUAL = 2.0


class PivotReason(Enum):
    """Why a pivot calibration was refused."""

    TOO_FEW = "too few poses"
    TOO_NARROW = "tool turned too little"
    RESIDUAL = "tip did not rest"


class PivotError(UserError):
    """Poses from which no trustworthy tip can be found."""

    def __init__(self, reason: PivotReason, message: str) -> None:
        super().__init__(message)
        self.reason = reason


@dataclass(frozen=True, slots=True, eq=False)
class PivotCalibration:
    """A tool's tip, found by pivoting."""

    tip_mm: NDArray[np.float64]
    """(3,) in the frame of the stated tip: where the true tip is."""
    point_mm: NDArray[np.float64]
    """(3,) device frame: where the tip rested."""
    residual_mm: float
    """rms per axis; tells whether the tip rested, nothing about ``tip_mm``."""
    condition: float
    covariance: NDArray[np.float64]
    """(3, 3) mm^2 of ``tip_mm``, for independent noise of ``residual_mm``."""
    frames: NDArray[np.float64]
    """(n, 4, 4) the poses from which it was found, as the arm stated them."""
    along_axis: bool
    """Whether only the length was found."""


def shifted_to_tip(pose: Pose, tip_mm: NDArray[np.float64]) -> Pose:
    """Return ``pose`` with its origin at ``tip_mm`` (3,) of its own frame."""
    frame = pose.device_from_tip.copy()
    frame[:3, 3] += frame[:3, :3] @ tip_mm
    return replace(pose, device_from_tip=frame)


def calibrate_pivot(
    frames: NDArray[np.float64],
    *,
    along_axis: bool = False,
    noise_mm: float = NOISE_MM,
    fewest: int = FEWEST_POSES,
    largest_condition: float = LARGEST_CONDITION,
) -> PivotCalibration:
    """Find the tip from device_from_tip frames (n, 4, 4) with the tip at rest.

    ``along_axis`` finds only the length: an arm that does not measure the turn of its
    stylus cannot know on which side of the axis a tip is. ``noise_mm`` is the expected
    error of a pose, per axis.
    Raise PivotError for too few poses, too small a cone, or a tip that moved.
    """
    if frames.ndim != 3 or frames.shape[1:] != (4, 4):
        raise UserError(f"frames must have shape (n, 4, 4), got {frames.shape}")
    count = len(frames)
    if count < fewest:
        raise PivotError(
            PivotReason.TOO_FEW,
            f"The tip was turned for {count} poses only, {fewest} are needed; go on "
            "for longer.",
        )
    free = frames[:, :3, 2:3] if along_axis else frames[:, :3, :3]
    unknowns = free.shape[-1]
    point = np.broadcast_to(-np.eye(3), (count, 3, 3))
    system = np.concatenate((free, point), axis=2).reshape(3 * count, unknowns + 3)
    singular = np.linalg.svd(system, compute_uv=False)
    condition = float(singular[0] / max(singular[-1], 1e-300))
    if condition > largest_condition:
        raise PivotError(
            PivotReason.TOO_NARROW,
            f"The tool was turned by {half_cone_deg(frames):.0f} degrees about its "
            f"tip, which leaves the tip uncertain (condition {condition:.0f}, "
            f"{largest_condition:g} is allowed); tilt it further to all sides.",
        )
    wanted = -frames[:, :3, 3].reshape(-1)
    solution = np.asarray(np.linalg.lstsq(system, wanted)[0], dtype=np.float64)
    left = system @ solution - wanted
    residual = float(np.sqrt(left @ left / (3 * count - unknowns - 3)))
    if residual > LARGEST_RESIDUAL * noise_mm:
        raise PivotError(
            PivotReason.RESIDUAL,
            f"The tip did not rest: it wandered by {residual:.2f} mm rms, "
            f"{LARGEST_RESIDUAL * noise_mm:g} mm is allowed; hold it in its hole.",
        )
    tip = np.zeros(3)
    tip[3 - unknowns :] = solution[:unknowns]
    covariance = np.zeros((3, 3))
    inverse = np.linalg.inv(system.T @ system)[:unknowns, :unknowns]
    covariance[3 - unknowns :, 3 - unknowns :] = residual**2 * inverse
    return PivotCalibration(
        tip,
        solution[unknowns:],
        residual,
        condition,
        covariance,
        frames.copy(),
        along_axis,
    )


def half_cone_deg(frames: NDArray[np.float64]) -> float:
    """Return the largest angle of the tool's axis from its mean, degrees."""
    axes = frames[:, :3, 2]
    mean = axes.mean(axis=0)
    length = float(np.linalg.norm(mean))
    if length < 1e-9:
        return 180.0
    return float(np.degrees(np.arccos(np.clip(axes @ mean / length, -1.0, 1.0).min())))
