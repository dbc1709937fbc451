"""Turn of a scope about its shaft, which a five-joint arm does not measure.

Roll is counted as everywhere: right-handed about the pointing direction, zero where
the top of the picture is as near as possible to the patient's superior direction.
Whoever needs it asks a ``RollSource``; None means that nobody knows.
"""

import math
import threading
from bisect import bisect_right
from collections import deque
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from devices.pose import Pose, read_only_rigid
from system import UserError

SUPERIOR = np.array([0.0, 0.0, 1.0])
ANTERIOR = np.array([0.0, -1.0, 0.0])

PARALLEL = 0.999
"""Cosine above which the shaft counts as parallel to the patient's long axis."""

STALE_S = 0.1
"""A second device that was silent for so long does not know the roll any more."""

KEPT = 1024
"""Readings of a second device: ten seconds at 100 Hz."""


class RollSource(Protocol):
    """Anything that knows the roll of the tool at the moment of a pose."""

    def roll_deg(self, pose: Pose) -> float | None:
        """Return the roll in degrees, continuous over poses; None when unknown."""
        ...


def upright(pointing: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the unit direction (3,) of zero roll for a unit pointing, patient LPS.

    A tool along the patient's long axis takes the patient's front for up.
    """
    up = SUPERIOR if abs(float(pointing @ SUPERIOR)) < PARALLEL else ANTERIOR
    across = up - (up @ pointing) * pointing
    unit: NDArray[np.float64] = across / np.linalg.norm(across)
    return unit


@dataclass(frozen=True, slots=True)
class HorizonRoll:
    """The horizon rule: the camera's head is held upright whatever the shaft does."""

    def roll_deg(self, pose: Pose) -> float | None:
        """Return 0."""
        return 0.0


@dataclass(slots=True, eq=False)
class EncoderRoll:
    """The roll of an arm with a sixth encoder, seen in the turn of its tip frame.

    The encoder counts from wherever the scope was clamped, so that somebody has to
    say once which way its light post pointed: ``level`` does.
    """

    world_from_device: NDArray[np.float64]
    mount_deg: float = 0.0
    """Added to the measured roll; `level` sets it."""
    _last: float | None = None

    def __post_init__(self) -> None:
        self.world_from_device = read_only_rigid(
            self.world_from_device, "world_from_device"
        )

    def level(self, pose: Pose, at_deg: float = 0.0) -> None:
        """Declare that the scope's roll at this pose is ``at_deg``."""
        self.mount_deg += at_deg - (self._measured(pose) + self.mount_deg)
        self._last = None

    def roll_deg(self, pose: Pose) -> float | None:
        """Return the measured roll; it continues the last one over half turns."""
        roll = self._measured(pose) + self.mount_deg
        last = self._last if self._last is not None else 0.0
        self._last = last + math.remainder(roll - last, 360.0)
        return self._last

    def _measured(self, pose: Pose) -> float:
        """Return the angle of the frame's x axis from upright, -180 to 180 degrees."""
        frame = self.world_from_device[:3, :3] @ pose.device_from_tip[:3, :3]
        pointing = -frame[:, 2]
        up = upright(pointing)
        right = np.cross(pointing, up)
        return math.degrees(math.atan2(frame[:, 0] @ right, frame[:, 0] @ up))


@dataclass(slots=True)
class SecondDeviceRoll:
    """Readings of another device, joined to poses by the host's clock.

    ``put`` may be called from another thread than ``roll_deg``.
    """

    stale_s: float = STALE_S
    _times: deque[float] = field(default_factory=lambda: deque(maxlen=KEPT))
    _rolls: deque[float] = field(default_factory=lambda: deque(maxlen=KEPT))
    _lock: threading.Lock = field(default_factory=threading.Lock)

    def put(self, host_time_s: float, degrees: float) -> None:
        """Take a reading; its full turns are found from the one before.

        UserError when it is not finite or not newer than the last one.
        """
        if not (math.isfinite(host_time_s) and math.isfinite(degrees)):
            raise UserError(f"a reading must be finite: {degrees} at {host_time_s}")
        with self._lock:
            if self._times and host_time_s <= self._times[-1]:
                raise UserError(
                    f"readings must come in order, got {host_time_s} after "
                    f"{self._times[-1]}"
                )
            last = self._rolls[-1] if self._rolls else degrees
            self._rolls.append(last + math.remainder(degrees - last, 360.0))
            self._times.append(host_time_s)

    def roll_deg(self, pose: Pose) -> float | None:
        """Return the roll when the pose was measured, None without a fresh reading.

        Between two readings it is interpolated; after the last one it is held.
        """
        with self._lock:
            times, rolls = list(self._times), list(self._rolls)
        after = bisect_right(times, pose.host_time_s)
        if after == 0 or pose.host_time_s - times[after - 1] > self.stale_s:
            return None
        if after == len(times):
            return rolls[-1]
        start, end = times[after - 1], times[after]
        share = (pose.host_time_s - start) / (end - start)
        return rolls[after - 1] + share * (rolls[after] - rolls[after - 1])
