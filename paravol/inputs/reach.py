"""Poses that no hand at the head can have: a tracker's word for a tool it misses.

Some send 1e6 mm, or -3.697e28, others leave a tool where nobody stands. Such a pose is
a gap, as if nothing had come: what follows it is not reached from there.
"""

import math
import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices import DeviceError, DeviceReason, Pose
from paravol.inputs.pose_sources import EndedError, OrderedPoses
from renderers.scene import Volume

REACH_MM = 2000.0
"""From the head's middle: who is farther away does not hold a tool in it."""

AWAY_S = 0.25
"""After so long without a pose in reach it is said that the tool is away."""


@dataclass(slots=True)
class Reach:
    """Tell poses in a hand's reach from others, and count these.

    middle_mm: of the head, ``(3,)`` in the frame of the poses. left_out: so many were
    not in reach so far.
    """

    middle_mm: NDArray[np.float64]
    left_out: int = 0

    @classmethod
    def of(cls, head: Volume, world_from_device: NDArray[np.float64]) -> "Reach":
        """Return the reach around a head.

        world_from_device: 4x4, where the poses lie in the patient.
        """
        middle = np.append((np.array(head.shape[::-1]) - 1) / 2, 1.0)
        place = np.linalg.solve(world_from_device, head.world_from_voxel @ middle)
        return cls(place[:3])

    def holds(self, pose: Pose) -> bool:
        """Return whether a pose is in reach; count it where it is not."""
        is_held = math.dist(pose.tip_mm, self.middle_mm) <= REACH_MM
        self.left_out += not is_held
        return is_held

    def told(self) -> str:
        """Return a sentence on what was left out, "" for nothing."""
        if self.left_out == 0:
            return ""
        return f"{self.left_out} poses lay beyond any hand's reach and were left out."


@dataclass(slots=True)
class ReachedPoses:
    """Pass on what is in reach; tell once, as a loss, that a tool stays out of it.

    reach: None until it is known where the poses lie: then all are passed on.
    """

    source: OrderedPoses
    reach: Reach | None = None
    _last_s: float | None = None
    _is_away: bool = False

    def read(self, timeout_s: float) -> Pose:
        """Return the next pose in reach; raise as the source does.

        Raise DeviceError(OUT_OF_REACH) once when none was for a while, and EndedError
        where the source has come to its end.
        """
        until = time.monotonic() + timeout_s
        while True:
            try:
                pose = self.source.read(max(until - time.monotonic(), 0.0))
            except EOFError as error:
                raise EndedError from error
            if self.reach is None or self.reach.holds(pose):
                self._last_s, self._is_away = pose.host_time_s, False
                return pose
            last_s = self._last_s
            if self._is_away or (
                last_s is not None and pose.host_time_s - last_s <= AWAY_S
            ):
                continue
            self._is_away = True
            raise DeviceError(
                DeviceReason.OUT_OF_REACH,
                "The tool is out of reach: its poses lie more than "
                f"{REACH_MM / 1000:g} m from the head. Bring it back, into view of its "
                "tracker.",
            )
