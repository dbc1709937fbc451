"""Angle registers of an emulated arm, and what it does without a path.

It stands still, or its joints follow a function.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from devices.microscribe.kinematics.arm import FIELD, JOINTS
from devices.microscribe.kinematics.inverse import InverseKinematics
from devices.microscribe.kinematics.profiles import ArmProfile
from system import UserError

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
        """Return the joint angles at rest, six, radians; 0 without encoder."""
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


AnglesAt = Callable[[float], Sequence[float] | NDArray[np.float64]]
"""Seconds since the first packet -> five or six joint angles, radians."""

TipAt = Callable[[float], tuple[NDArray[np.float64], NDArray[np.float64]]]
"""Seconds since the first packet -> tip (3,) mm and unit pointing direction (3,)."""

ORBIT_CENTRE_MM = (250.0, 0.0, 110.0)
ORBIT_RADIUS_MM = 40.0
ORBIT_PERIOD_S = 8.0


class StillMotion:
    """An arm that stands where it is put; pedals included."""

    def __init__(
        self, profile: ArmProfile, counts: tuple[int, ...] | None = None
    ) -> None:
        self._home = profile.home_counts
        self._index_turn = profile.encoders.turn[-1] if profile.has_roll_index else 0
        self.counts = profile.home_counts if counts is None else counts
        """Six of 14 bits; write new ones to move the arm."""
        self.buttons = 0
        self.homed = 0
        """How often home counts were loaded."""

    def begin(self, now_s: float) -> None:
        """Do nothing: it has no clock."""

    def latch(self, now_s: float) -> tuple[tuple[int, ...], int]:
        """Return six counts of 14 bits, then pedals and index bit of a roll encoder."""
        on_mark = self._index_turn and self.counts[-1] % self._index_turn == 0
        return self.counts, self.buttons | (INDEX_BIT if on_mark else 0)

    def home(self) -> None:
        """Load the rest pose's counts, wherever the arm stands."""
        self.counts = self._home
        self.homed += 1


class Motion(ABC):
    """An arm that moves, from its zero at the first packet on."""

    def __init__(self, profile: ArmProfile) -> None:
        self._registers = AngleRegisters(profile)
        self._began_s: float | None = None
        self._angles: Sequence[float] = self._registers.home_angles

    @abstractmethod
    def at(self, elapsed_s: float) -> tuple[Sequence[float], int]:
        """Return six angles, radians, and the pedals; seconds since the beginning."""

    def begin(self, now_s: float) -> None:
        """Start the motion's own clock; harmless when repeated."""
        if self._began_s is None:
            self._began_s = now_s

    def latch(self, now_s: float) -> tuple[tuple[int, ...], int]:
        """Return six counts of 14 bits, then pedals and index bit of a roll encoder."""
        began_s = now_s if self._began_s is None else self._began_s
        self._angles, pedals = self.at(now_s - began_s)
        counts, index = self._registers.read(self._angles)
        return counts, pedals | index

    def home(self) -> None:
        """Load the rest pose's counts, wherever the arm stands."""
        self._registers.home(self._angles)


class AnglesMotion(Motion):
    """An arm whose joints follow a function."""

    def __init__(self, profile: ArmProfile, angles_at: AnglesAt) -> None:
        super().__init__(profile)
        self._angles_at = angles_at
        self._roll = self._registers.home_angles[-1]
        self._angles, _ = self.at(0.0)

    def at(self, elapsed_s: float) -> tuple[Sequence[float], int]:
        """Return the function's angles; UserError unless there are five or six."""
        plain = [float(angle) for angle in self._angles_at(elapsed_s)]
        if len(plain) == JOINTS - 1:
            plain.append(self._roll)
        if len(plain) != JOINTS or not all(map(math.isfinite, plain)):
            raise UserError(f"five or six finite angles are needed, got {plain}")
        return plain, 0


def follow_tip(profile: ArmProfile, tip_at: TipAt) -> AnglesMotion:
    """Return a motion that holds the tip where ``tip_at`` says, in the arm's frame.

    Angles run on without a jump of a whole turn. UnreachableError while it is running
    means that the function has left the reach of the arm.
    """
    inverse = InverseKinematics(profile.geometry)

    angles = np.array(AngleRegisters(profile).home_angles)

    def angles_at(t_s: float) -> NDArray[np.float64]:
        nonlocal angles
        tip_mm, pointing = (np.asarray(v, dtype=np.float64) for v in tip_at(t_s))
        solved = inverse.solve_afresh(tip_mm, pointing, angles)
        angles = angles + shorter_way(solved - angles)
        return angles

    return AnglesMotion(profile, angles_at)


def shorter_way(turn: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return turns of the joints by the short way round, radians."""
    short: NDArray[np.float64] = np.remainder(turn + np.pi, 2.0 * np.pi) - np.pi
    return short


def orbit(profile: ArmProfile) -> AnglesMotion:
    """Return a motion for people: the tip circles beside the base, nodding slowly."""

    def tip_at(t_s: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        phase = 2.0 * math.pi * t_s / ORBIT_PERIOD_S
        round_mm = np.array([math.cos(phase), math.sin(phase), 0.3 * math.sin(phase)])
        lean = np.array([0.3 * math.cos(phase / 2.0), 0.3 * math.sin(phase), -1.0])
        return (
            np.array(ORBIT_CENTRE_MM) + ORBIT_RADIUS_MM * round_mm,
            lean / np.linalg.norm(lean),
        )

    return follow_tip(profile, tip_at)
