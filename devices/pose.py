"""Where a tracked tool is at one moment."""

from dataclasses import dataclass
from enum import IntFlag
from math import isfinite

import numpy as np
from numpy.typing import NDArray

from system import UserError

# A product of six float64 joint matrices stays orthonormal to about 1e-15;
# anything beyond this is a wrong matrix rather than rounding.
RIGID_TOLERANCE = 1e-6


class PoseFlag(IntFlag):
    """What a consumer should know before it trusts a pose."""

    NONE = 0
    JUMP = 1
    """The tool moved implausibly far since the last pose, several times running."""
    SUSPECT = 2
    """Bytes that belong to no packet followed the one that gave this pose."""


def read_only_rigid(matrix: NDArray[np.float64], name: str) -> NDArray[np.float64]:
    """Return a read-only (4, 4) float64 copy; raise ValueError unless it is rigid."""
    copy = np.array(matrix, dtype=np.float64)
    if copy.shape != (4, 4):
        raise UserError(f"{name} must have shape (4, 4), got {copy.shape}")
    # Plain floats: at this size they take a tenth of the time of small arrays, and
    # every pose of an arm passes here.
    rows: list[list[float]] = copy.tolist()
    if not all(isfinite(value) for row in rows for value in row):
        raise UserError(f"{name} must be finite, got {rows}")
    drift, turned = _drift_and_handedness(rows)
    if drift > RIGID_TOLERANCE or turned < 0.0:
        raise UserError(f"{name} must be a rotation, off by {drift:.3g}")
    if rows[3] != [0.0, 0.0, 0.0, 1.0]:
        raise UserError(f"{name} must end in 0 0 0 1, got {rows[3]}")
    copy.flags.writeable = False
    return copy


def _drift_and_handedness(rows: list[list[float]]) -> tuple[float, float]:
    """Return the largest element of |R R^T - 1| and det R."""
    (a, b, c, _), (d, e, f, _), (g, h, i, _), _ = rows
    drift = max(
        abs(a * a + b * b + c * c - 1.0),
        abs(d * d + e * e + f * f - 1.0),
        abs(g * g + h * h + i * i - 1.0),
        abs(a * d + b * e + c * f),
        abs(a * g + b * h + c * i),
        abs(d * g + e * h + f * i),
    )
    return drift, a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g)


@dataclass(frozen=True, slots=True, eq=False)
class Pose:
    """Tool pose in the frame of its device.

    The tip frame has its origin at the tip; its +z axis runs from the tip back up
    the shaft, so the tool points along -z. A five-joint arm does not measure the
    rotation about that axis: x and y of the tip frame then follow the wrist and
    say nothing about roll.
    """

    time_s: float
    """Seconds on the device's own monotonic clock."""
    host_time_s: float
    """Host's monotonic clock when the first byte of the sample arrived, or would have
    arrived had nothing on the way held it up."""
    device_from_tip: NDArray[np.float64]
    """(4, 4) float64, mm, read-only."""
    buttons: int
    """Bit 0 right pedal, bit 1 left pedal; 1 = pressed."""
    flags: PoseFlag = PoseFlag.NONE

    def __post_init__(self) -> None:
        if not (isfinite(self.time_s) and isfinite(self.host_time_s)):
            raise UserError(
                f"pose times must be finite, got {self.time_s}, {self.host_time_s}"
            )
        if self.buttons < 0:
            raise UserError(f"buttons must not be negative, got {self.buttons}")
        rigid = read_only_rigid(self.device_from_tip, "device_from_tip")
        object.__setattr__(self, "device_from_tip", rigid)

    @classmethod
    def of_rigid(
        cls,
        time_s: float,
        host_time_s: float,
        device_from_tip: NDArray[np.float64],
        buttons: int,
        flags: PoseFlag = PoseFlag.NONE,
    ) -> "Pose":
        """Make a pose without checks, for those who built the matrix from rotations.

        The array is kept and made read-only. Checking costs as much as the kinematics
        of an arm.
        """
        device_from_tip.flags.writeable = False
        pose = object.__new__(cls)
        put = object.__setattr__
        put(pose, "time_s", time_s)
        put(pose, "host_time_s", host_time_s)
        put(pose, "device_from_tip", device_from_tip)
        put(pose, "buttons", buttons)
        put(pose, "flags", flags)
        return pose

    @property
    def tip_mm(self) -> NDArray[np.float64]:
        """Return the tip, (3,) mm, device frame."""
        return self.device_from_tip[:3, 3]

    @property
    def pointing(self) -> NDArray[np.float64]:
        """Return the unit direction from the hand to the tip, (3,), device frame."""
        return -self.device_from_tip[:3, 2]
