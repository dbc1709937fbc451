"""An emulated arm that follows a path with the constants of its metal.

Where ``ArmScript`` plays an arm that is exactly what its block says, this one has its
own lengths and angles, and its own tip; the host knows only the block.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from devices.microscribe.emulator.motion import Motion
from devices.microscribe.emulator.script import Track
from devices.microscribe.kinematics.error_model import KinematicErrorModel
from devices.microscribe.kinematics.profiles import ArmProfile
from devices.recording.probe_path import ProbePath


class RehearsedArm(Motion):
    """Counts and pedals of an arm that follows a path from the first packet on."""

    def __init__(
        self,
        profile: ArmProfile,
        built: KinematicErrorModel,
        path: ProbePath,
        device_from_world: NDArray[np.float64],
    ) -> None:
        """Solve the way; raise UnreachableError when the arm cannot get somewhere."""
        super().__init__(profile)
        angles = np.array(self._angles)
        turn, shift = device_from_world[:3, :3], device_from_world[:3, 3]
        tips, axes = path.tip_mm @ turn.T + shift, path.axis @ turn.T
        solved = []
        for tip, axis in zip(tips, axes, strict=True):
            angles = built.angles(tip, axis, angles)
            solved.append(angles)
        self.track = Track.of(path, solved)

    def at(self, elapsed_s: float) -> tuple[Sequence[float], int]:
        """Return six angles and the pedals."""
        return self.track.at(elapsed_s)
