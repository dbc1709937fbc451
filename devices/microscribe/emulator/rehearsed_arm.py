"""An emulated arm that follows a path with the constants of its metal.

Where ``ArmScript`` plays an arm that is exactly what its block says, this one has its
own lengths and angles, and its own tip; the host knows only the block.
"""

import numpy as np
from numpy.typing import NDArray

from devices.microscribe.kinematics.arm import FIELD, JOINTS
from devices.microscribe.kinematics.error_model import KinematicErrorModel
from devices.microscribe.kinematics.profiles import ArmProfile
from devices.recording.probe_path import ProbePath


class RehearsedArm:
    """Counts and pedals of an arm that follows a path from the first packet on."""

    def __init__(
        self,
        profile: ArmProfile,
        built: KinematicErrorModel,
        path: ProbePath,
        device_from_world: NDArray[np.float64],
    ) -> None:
        """Solve the way; raise UnreachableError when the arm cannot get somewhere."""
        self._encoders = profile.encoders
        self._home_counts = np.array(profile.home_counts, dtype=np.int64)
        self._offset = np.zeros(JOINTS, dtype=np.int64)
        self._path = path
        self._began_s: float | None = None
        self._elapsed_s = 0.0
        angles = self._encoders.angles(self._home_counts)
        angles[JOINTS - 1] = 0.0
        turn, shift = device_from_world[:3, :3], device_from_world[:3, 3]
        tips, axes = path.tip_mm @ turn.T + shift, path.axis @ turn.T
        solved = []
        for tip, axis in zip(tips, axes, strict=True):
            angles = built.angles(tip, axis, angles)
            solved.append(angles)
        # Neighbours by the short way round, so that what lies between is between.
        self._track = np.unwrap(np.array(solved), axis=0)

    def begin(self, now_s: float) -> None:
        """Start the path's clock; harmless when repeated."""
        if self._began_s is None:
            self._began_s = now_s

    def latch(self, now_s: float) -> tuple[tuple[int, ...], int]:
        """Return six counts of 14 bits, then the pedals."""
        began = now_s if self._began_s is None else self._began_s
        self._elapsed_s = now_s - began
        angles, pedals = self.angles_at(self._elapsed_s)
        counts = self._encoders.counts(angles) + self._offset
        # An encoder that is not built in sends a constant.
        counts[JOINTS - 1] = self._home_counts[JOINTS - 1]
        return tuple(int(count) for count in counts % FIELD), pedals

    def angles_at(self, t_s: float) -> tuple[NDArray[np.float64], int]:
        """Return encoder angles (6,) and pedals at seconds of the path."""
        times = self._path.t_s
        now = min(max(t_s, 0.0), self._path.duration_s)
        angles = np.array([np.interp(now, times, joint) for joint in self._track.T])
        before = int(np.searchsorted(times, now, side="right")) - 1
        return angles, int(self._path.buttons[before])

    def home(self) -> None:
        """Load the rest pose's counts, wherever the arm stands."""
        angles, _ = self.angles_at(self._elapsed_s)
        self._offset = self._home_counts - self._encoders.counts(angles)
