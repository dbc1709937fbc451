"""An emulated arm that follows a path with the constants of its metal.

Where ``ArmScript`` plays an arm that is exactly what its block says, this one has its
own lengths and angles, and its own tip; the host knows only the block.
"""

import numpy as np
from numpy.typing import NDArray

from devices.microscribe.emulator.motion import AngleRegisters
from devices.microscribe.emulator.script import Track
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
        self._registers = AngleRegisters(profile)
        self._began_s: float | None = None
        self._elapsed_s = 0.0
        angles = np.array(self._registers.home_angles)
        turn, shift = device_from_world[:3, :3], device_from_world[:3, 3]
        tips, axes = path.tip_mm @ turn.T + shift, path.axis @ turn.T
        solved = []
        for tip, axis in zip(tips, axes, strict=True):
            angles = built.angles(tip, axis, angles)
            solved.append(angles)
        self.track = Track.of(path, solved)

    def begin(self, now_s: float) -> None:
        """Start the path's clock; harmless when repeated."""
        if self._began_s is None:
            self._began_s = now_s

    def latch(self, now_s: float) -> tuple[tuple[int, ...], int]:
        """Return six counts of 14 bits, then the pedals."""
        began = now_s if self._began_s is None else self._began_s
        self._elapsed_s = now_s - began
        angles, pedals = self.track.at(self._elapsed_s)
        return self._registers.read(angles)[0], pedals

    def home(self) -> None:
        """Load the rest pose's counts, wherever the arm stands."""
        self._registers.home(self.track.at(self._elapsed_s)[0])
