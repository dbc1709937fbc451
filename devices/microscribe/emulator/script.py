"""What the emulated arm does: touch the fiducials, then follow a probe path.

The script's clock begins with the first poll. The right pedal (bit 0) is down while a
fiducial is being held, the left one (bit 1) from the very packet that carries the
path's first sample until its end, so that whoever reads the poses can find the path's
time zero to the tick.
"""

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices.microscribe.emulator.motion import Motion, shorter_way
from devices.microscribe.kinematics.error_model import KinematicErrorModel
from devices.microscribe.kinematics.inverse import InverseKinematics
from devices.microscribe.kinematics.profiles import ArmProfile
from devices.recording.probe_path import ProbePath, ProbeSample

MARK_PEDAL = 1
PATH_PEDAL = 2

HOLD_S = 0.6
# The stylus has come to rest before the pedal goes down and leaves after it is up.
PRESS_FROM_S, PRESS_TO_S = 0.1, 0.5

# Physiological tremor: 8-12 Hz, here 0.1 mm rms of each held point.
TREMOR_MM = 0.1
TREMOR_HZ = (8.3, 9.7, 11.4)
SLOPE_STEP_MM = 0.1

# A calm hand; a third of what the driver takes for possible.
TRAVEL_DEG_S = 240.0
SHORTEST_TRAVEL_S = 0.4

# Samples of a path that are solved before it is played: 100 s at 100 Hz, 6 s of work.
LARGEST_TRACK = 10_000

# Peak speed of the minimum-jerk profile over its mean speed.
MINIMUM_JERK_PEAK = 1.875


@dataclass(frozen=True, slots=True, eq=False)
class _Leg:
    """One leg of the way to the path: travel to a fiducial, then hold it."""

    start_s: float
    travel_s: float
    start: NDArray[np.float64]
    end: NDArray[np.float64]
    point_mm: NDArray[np.float64] | None
    """(3,) device frame; None on the leg that leads to the path."""
    angles_per_mm: NDArray[np.float64]
    """(6, 3) what a small step of the tip asks of the joints at the end."""

    @property
    def end_s(self) -> float:
        hold = 0.0 if self.point_mm is None else HOLD_S
        return self.start_s + self.travel_s + hold


@dataclass(frozen=True, slots=True)
class Track:
    """A path solved beforehand.

    Solving takes 0.6 ms a pose, looking it up a few microseconds, which leaves more
    of the processor to the program under test. Between two samples the angles run
    evenly, as the path itself does.
    """

    times: list[float]
    angles: list[list[float]]
    buttons: list[int]

    @classmethod
    def of(cls, path: ProbePath, solved: Sequence[NDArray[np.float64]]) -> "Track":
        """Take six angles for every sample; neighbours by the short way round."""
        angles = np.unwrap(np.array(solved), axis=0)
        return cls(path.t_s.tolist(), angles.tolist(), path.buttons.tolist())

    def at(self, t_s: float) -> tuple[list[float], int]:
        """Return six angles and the pedals; before and after it stands still."""
        now = min(max(t_s, 0.0), self.times[-1])
        before = bisect_right(self.times, now) - 1
        after = min(before + 1, len(self.times) - 1)
        span = self.times[after] - self.times[before] or 1.0
        share = (now - self.times[before]) / span
        mixed = [
            start + share * (end - start)
            for start, end in zip(self.angles[before], self.angles[after], strict=True)
        ]
        return mixed, self.buttons[before]


class ArmScript(Motion):
    """Counts and pedals of an arm whose base stands somewhere beside the patient."""

    def __init__(
        self,
        profile: ArmProfile,
        path: ProbePath,
        device_from_world: NDArray[np.float64],
        fiducials_mm: NDArray[np.float64],
        seed: int,
    ) -> None:
        """Plan the way; ``fiducials_mm`` is (n, 3), patient LPS.

        Raise UnreachableError when the arm cannot get somewhere.
        """
        super().__init__(profile)
        self._has_roll = profile.encoders.turn[5] > 1
        self._inverse = InverseKinematics(profile.geometry)
        self._path = path
        self._from_world = device_from_world
        self._rest = np.array(self._registers.home_angles)
        self._phases = np.random.default_rng(seed).uniform(0.0, 2.0 * np.pi, (3, 3))
        self._path_began_s: float | None = None
        self._approach = self._into_device(path.sample(0.0).axis, turn_only=True)
        self._legs = self._plan(fiducials_mm)
        self._track = self._solve_track()

    def at(self, elapsed_s: float) -> tuple[Sequence[float], int]:
        """Return six angles and the pedals."""
        for leg in self._legs:
            if elapsed_s < leg.end_s:
                return self._along(leg, elapsed_s)
        return self._follow(elapsed_s)

    def _along(self, leg: _Leg, elapsed_s: float) -> tuple[Sequence[float], int]:
        u = (elapsed_s - leg.start_s) / leg.travel_s
        if u < 1.0 or leg.point_mm is None:
            blend = u**3 * (10.0 - 15.0 * u + 6.0 * u**2)
            return (leg.start + blend * (leg.end - leg.start)).tolist(), 0
        held_s = elapsed_s - leg.start_s - leg.travel_s
        waves = np.sin(2.0 * np.pi * np.outer(TREMOR_HZ, [held_s] * 3) + self._phases)
        # Three sines of this amplitude on three axes have an rms length of TREMOR_MM.
        shake = TREMOR_MM * np.sqrt(2.0 / 9.0) * waves.sum(axis=0)
        marks = PRESS_FROM_S <= held_s < PRESS_TO_S
        angles = (leg.end + leg.angles_per_mm @ shake).tolist()
        return angles, MARK_PEDAL if marks else 0

    def _follow(self, elapsed_s: float) -> tuple[Sequence[float], int]:
        if self._path_began_s is None:
            self._path_began_s = elapsed_s
        t_s = elapsed_s - self._path_began_s
        playing = PATH_PEDAL if t_s <= self._path.duration_s else 0
        if self._track is None:
            sample = self._path.sample(t_s)
            angles = self._pose_afresh(sample, np.array(self._angles))
            return angles.tolist(), sample.buttons | playing
        angles_then, buttons = self._track.at(t_s)
        return angles_then, buttons | playing

    def _solve_track(self) -> Track | None:
        """Solve the whole path before the first poll; None for long ones."""
        if len(self._path.t_s) > LARGEST_TRACK:
            return None
        angles = self._legs[-1].end
        track = []
        for time_s in self._path.t_s:
            angles = self._pose_afresh(self._path.sample(float(time_s)), angles)
            track.append(angles)
        return Track.of(self._path, track)

    def _pose_afresh(
        self, sample: ProbeSample, start: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        # After a pause of the polls the arm may be far from where it was last seen.
        angles = self._inverse.solve_afresh(
            self._into_device(sample.tip_mm),
            self._into_device(sample.axis, turn_only=True),
            start,
        )
        if self._has_roll:
            angles[5] = np.radians(sample.roll_deg)
        return angles

    def _plan(self, fiducials_mm: NDArray[np.float64]) -> list[_Leg]:
        legs: list[_Leg] = []
        clock, at = 0.0, self._rest
        stops = [self._into_device(point) for point in fiducials_mm]
        first = self._into_device(self._path.sample(0.0).tip_mm)
        for point in (*stops, first):
            solved = self._inverse.solve_afresh(point, self._approach, at)
            # The same pose by the short way round.
            end = at + shorter_way(solved - at)
            turn = float(np.degrees(np.abs(end - at).max()))
            travel = max(SHORTEST_TRAVEL_S, MINIMUM_JERK_PEAK * turn / TRAVEL_DEG_S)
            held = None if point is first else point
            legs.append(_Leg(clock, travel, at, end, held, self._slope(point, end)))
            clock, at = legs[-1].end_s, end
        return legs

    def _slope(
        self, point_mm: NDArray[np.float64], angles: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return the change of the angles per mm of tip, (6, 3).

        A tremor is so small that what is left out is below 0.001 mm, and solving for
        each packet would take most of the emulator's time.
        """
        steps = SLOPE_STEP_MM * np.eye(3)
        sides = [
            [
                self._inverse.solve(point_mm + sign * step, self._approach, angles)
                for sign in (1.0, -1.0)
            ]
            for step in steps
        ]
        return np.array([ahead - behind for ahead, behind in sides]).T / (
            2.0 * SLOPE_STEP_MM
        )

    def _into_device(
        self, vector: NDArray[np.float64], turn_only: bool = False
    ) -> NDArray[np.float64]:
        turned: NDArray[np.float64] = self._from_world[:3, :3] @ vector
        return turned if turn_only else turned + self._from_world[:3, 3]


class RehearsedArm(Motion):
    """An arm that follows a path from the first packet on, by its metal's constants.

    Where `ArmScript` plays an arm that is exactly what its block says, this one has its
    own lengths and angles, and its own tip; the host knows only the block.
    """

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
