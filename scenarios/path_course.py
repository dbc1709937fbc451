"""Hoops and stops from the way that somebody flew.

A hoop stands on the recorded way, facing along it, and is as wide as the air allows.
Where the way bends they stand closer together. A stop is a place where the tip paused.
Whoever flew the way passes all of them, in their order: each hoop's middle is a place
of the tip, and the tip went on through it.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from renderers.scene import Volume
from scenarios.tasks.rules import ABSENT_S
from scenarios.tasks.task import Follow, Point, Reach, Ring, Task
from system import UserError

STEP_MM = 0.5
"""The way is looked at in steps of at least this: an arm shakes the tip by less."""

SMOOTH_STEPS = 3.0
"""Standard deviation, in steps, of the weights that the way's direction is taken by."""

STRAIGHT_MM, TURN_DEG, LEAST_MM = 12.0, 35.0, 4.0
"""Hoops stand so far apart on a straight way, or after so much of a turn, but never
nearer than the last."""

NARROWEST_MM, WIDEST_MM = 1.5, 5.0
"""Of a hoop's radius; the air around its middle decides in between."""

PAUSE_MM, PAUSE_S = 1.0, 1.5
"""A pause is a tip that stays within this radius for so long."""

STOP_MM = 2.0
"""Radius of a stop: twice the pause's, for somebody else's hand."""

LONGEST_STOP_S = 2.0
"""A stop asks for half the pause at most, and never for more than this."""


@dataclass(frozen=True, slots=True)
class _Pause:
    """That samples from first to last, both included, stayed around a place."""

    first: int
    last: int
    place_mm: NDArray[np.float64]
    duration_s: float


def course_tasks(
    time_s: NDArray[np.float64], tip_mm: NDArray[np.float64], distance: Volume
) -> tuple[Task, ...]:
    """Return the tasks of a way: hoops to the next stop, the stop, and so on.

    time_s: ``(n,)`` of the score's clock. tip_mm: ``(n, 3)`` LPS. distance: signed air
    distance of the head, mm, negative in air. UserError where the way is too short.
    """
    pauses = _pauses(time_s, tip_mm)
    tasks: list[Task] = []
    begin = 0
    for pause in (*pauses, None):
        end = len(tip_mm) - 1 if pause is None else pause.first
        rings = _rings(begin, end, time_s, tip_mm, distance)
        if rings:
            number = sum(isinstance(task, Follow) for task in tasks) + 1
            tasks.append(
                Follow(
                    name=f"course {number}",
                    title=f"Pass the hoops of course {number}",
                    after=_last(tasks),
                    rings=rings,
                )
            )
        if pause is not None:
            number = sum(isinstance(task, Reach) for task in tasks) + 1
            tasks.append(
                Reach(
                    name=f"stop {number}",
                    title=f"Stop at place {number} and look",
                    after=_last(tasks),
                    place=_point(pause.place_mm),
                    radius_mm=STOP_MM,
                    hold_s=round(min(pause.duration_s / 2, LONGEST_STOP_S), 1),
                )
            )
            begin = pause.last
    if not tasks:
        raise UserError(
            "The recorded way is too short for a course: it needs "
            f"{2 * LEAST_MM:g} mm, or a pause of {PAUSE_S:g} s."
        )
    return tuple(tasks)


def score_clock_s(
    time_s: NDArray[np.float64], is_frozen: NDArray[np.bool_]
) -> NDArray[np.float64]:
    """Return ``(n,)`` what the score's clock showed; it stands between frozen samples.

    It starts at 0, as a path's does.
    """
    stands = is_frozen[1:] | is_frozen[:-1]
    steps = np.where(stands, 0.0, np.diff(time_s))
    return np.concatenate([[0.0], np.cumsum(steps)])


def _pauses(time_s: NDArray[np.float64], tip_mm: NDArray[np.float64]) -> list[_Pause]:
    """Find where the tip stayed, from the first on, as long as it did."""
    pauses: list[_Pause] = []
    first, count = 0, len(tip_mm)
    while first < count:
        last = first
        while (
            last + 1 < count
            and time_s[last + 1] - time_s[last] <= ABSENT_S
            and _apart(tip_mm[last + 1], tip_mm[first]) <= PAUSE_MM
        ):
            last += 1
        duration_s = float(time_s[last] - time_s[first])
        if duration_s >= PAUSE_S:
            place = tip_mm[first : last + 1].mean(axis=0)
            # one that drifts is one stop, not a row of them
            if not pauses or _apart(place, pauses[-1].place_mm) >= LEAST_MM:
                pauses.append(_Pause(first, last, place, duration_s))
            first = last
        first += 1
    return pauses


def _rings(
    begin: int,
    end: int,
    time_s: NDArray[np.float64],
    tip_mm: NDArray[np.float64],
    distance: Volume,
) -> tuple[Ring, ...]:
    """Return the hoops of the samples from begin to end."""
    kept = _steps(begin, end, tip_mm)
    if len(kept) < 3:
        return ()
    ways = np.diff(tip_mm[kept], axis=0)
    lengths = np.linalg.norm(ways, axis=1)
    smooth = gaussian_filter1d(ways, SMOOTH_STEPS, axis=0, mode="nearest")
    sizes = np.linalg.norm(smooth, axis=1)
    rings: list[Ring] = []
    since_mm = share = 0.0
    before: NDArray[np.float64] | None = None
    for n in range(1, len(kept) - 1):
        since_mm += float(lengths[n - 1])
        share += float(lengths[n - 1]) / STRAIGHT_MM
        mean = smooth[n - 1] + smooth[n]
        size = float(np.linalg.norm(mean))
        if size < 0.5 * (sizes[n - 1] + sizes[n]) or size < 0.5 * STEP_MM:
            # the way turns back here and has no direction
            continue
        axis = mean / size
        if before is not None:
            turn = math.acos(min(max(float(axis @ before), -1.0), 1.0))
            share += math.degrees(turn) / TURN_DEG
        before = axis
        if since_mm < LEAST_MM or share < 1.0:
            continue
        around = slice(kept[n - 1], kept[n + 1] + 1)
        goes_on = ways[n - 1] @ axis > 0.0 and ways[n] @ axis > 0.0
        if not goes_on or np.diff(time_s[around]).max() > ABSENT_S:
            continue
        place = tip_mm[kept[n]]
        air_mm = -float(distance.sample(place))
        radius_mm = min(max(air_mm, NARROWEST_MM), WIDEST_MM)
        rings.append(Ring(_point(place), _unit(axis), round(radius_mm, 2)))
        since_mm = share = 0.0
    return tuple(rings)


def _steps(begin: int, end: int, tip_mm: NDArray[np.float64]) -> list[int]:
    """Return the samples that are a step away from the one before."""
    kept = [begin]
    for n in range(begin + 1, end + 1):
        if _apart(tip_mm[n], tip_mm[kept[-1]]) >= STEP_MM:
            kept.append(n)
    return kept


def _last(tasks: Sequence[Task]) -> tuple[str, ...]:
    return (tasks[-1].name,) if tasks else ()


def _point(place: NDArray[np.float64]) -> Point:
    """Return a place to a thousandth of a millimetre, for people to read."""
    x, y, z = (round(float(v), 3) for v in place)
    return x, y, z


def _unit(axis: NDArray[np.float64]) -> Point:
    x, y, z = (round(float(v), 6) for v in axis)
    return x, y, z


def _apart(a: NDArray[np.float64], b: NDArray[np.float64]) -> float:
    return math.dist(a, b)
