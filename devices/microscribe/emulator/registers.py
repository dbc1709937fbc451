"""Angle registers of an emulated arm: continuous angles -> what a packet carries."""

import math
from collections.abc import Sequence

from devices.microscribe.kinematics.arm import FIELD, JOINTS
from devices.microscribe.kinematics.profiles import ArmProfile

# The index mark of a roll encoder shares the byte of the pedals.
INDEX_BIT = 4


class AngleRegisters:
    """Six counters that were preloaded with the home counts.

    They count on past a turn and wrap at 14 bits, as the line carries them. A joint
    without encoder always reads its home count.
    """

    def __init__(self, profile: ArmProfile) -> None:
        self._home = profile.home_counts
        self._turn = profile.encoders.turn
        self._scale = [turn / (2.0 * math.pi) for turn in self._turn]
        self._built_in = [turn > 1 for turn in self._turn]
        self._index = profile.has_roll_index
        self._offset = [0] * JOINTS

    @property
    def home_angles(self) -> tuple[float, ...]:
        """Get the joint angles at rest, six, radians; 0 without encoder."""
        return tuple(
            count / scale if built_in else 0.0
            for count, scale, built_in in zip(
                self._home, self._scale, self._built_in, strict=True
            )
        )

    def read(self, angles: Sequence[float]) -> tuple[tuple[int, ...], int]:
        """Return six counts of 14 bits, then the index bit."""
        unwrapped = self._counts(angles)
        counts = tuple(
            count % FIELD if built_in else home
            for count, built_in, home in zip(
                unwrapped, self._built_in, self._home, strict=True
            )
        )
        on_mark = self._index and unwrapped[-1] % self._turn[-1] == 0
        return counts, INDEX_BIT if on_mark else 0

    def home(self, angles: Sequence[float]) -> None:
        """Load the home counts while the joints stand at ``angles``."""
        self._offset = [0] * JOINTS
        standing = self._counts(angles)
        self._offset = [h - c for h, c in zip(self._home, standing, strict=True)]

    def _counts(self, angles: Sequence[float]) -> list[int]:
        return [
            round(angle * scale) + offset
            for angle, scale, offset in zip(
                angles, self._scale, self._offset, strict=True
            )
        ]
