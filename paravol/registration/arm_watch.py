"""What an arm says while it is looked at: counts, rate, and how still its tip is."""

from collections import deque
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices import Pose
from paravol.checks.arm_check import PEDALS

LOOK_S = 1.0
"""Rate and noise are those of the last second."""

STILL_MM = 1.0
"""A tip that moved farther within the last second is not at rest."""

FEWEST = 5
"""Poses from which anything is said of rate and noise."""


@dataclass(frozen=True, slots=True)
class ArmReading:
    """What an arm says now.

    counts: of its encoders. tip_mm: ``(3,)`` in its own frame. pedals: names of those
    that are down. rate_hz: poses a second, None before there are enough. noise_mm: rms
    distance of the tip from its mean while it rests, None while it moves.
    """

    counts: tuple[int, ...]
    tip_mm: NDArray[np.float64]
    pedals: tuple[str, ...]
    rate_hz: float | None
    noise_mm: float | None


class ArmWatch:
    """Gather the poses of the last second."""

    def __init__(self) -> None:
        self._poses: deque[tuple[float, NDArray[np.float64]]] = deque()

    def feed(self, pose: Pose, counts: tuple[int, ...]) -> ArmReading:
        """Take a pose and the counts that it came from; return how the arm stands."""
        poses = self._poses
        poses.append((pose.time_s, pose.tip_mm))
        while poses[0][0] < pose.time_s - LOOK_S:
            poses.popleft()
        down = tuple(name for n, name in enumerate(PEDALS) if pose.buttons & 1 << n)
        rate, noise = None, None
        passed = poses[-1][0] - poses[0][0]
        if len(poses) >= FEWEST and passed > 0.0:
            rate = (len(poses) - 1) / passed
            tips = np.array([tip for _, tip in poses])
            off = np.linalg.norm(tips - tips.mean(axis=0), axis=1)
            if float(off.max()) < STILL_MM:
                noise = float(np.sqrt(np.mean(off**2)))
        return ArmReading(counts, pose.tip_mm, down, rate, noise)
