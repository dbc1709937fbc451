"""A motion that meets an obstacle stops there, and slides along it."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Gap = Callable[[NDArray[np.float64]], float]
"""How much is free at a place, negative in the obstacle; continuous."""

HALVINGS = 3
"""A step of a quarter of a millimetre ends within 0.03 mm of the contact."""

FEEL = 0.02
"""How far aside the obstacle's slope is felt for, in units of the place."""

HAIR = 1e-6
"""Kept from an obstacle that bends towards the motion, against rounding."""


def slid(
    start: NDArray[np.float64],
    end: NDArray[np.float64],
    within: Callable[[NDArray[np.float64]], NDArray[np.float64]],
    gap: Gap,
    least: float,
) -> NDArray[np.float64]:
    """Return where a straight motion gets, (n,), coordinates of like scale.

    ``within`` brings a place that the motion is turned aside to into its bounds.

    Never where there is a smaller gap than ``least``, or than at the start when that
    is smaller already; never farther from the start than ``end`` is. What the obstacle
    takes of the motion is the part that runs into it. Only the end is looked at, so a
    motion must be shorter than what moves is thick.
    """
    floor = min(least, gap(start))
    if gap(end) >= floor:
        return end
    reached = _until_contact(start, end, gap, floor)
    slope = slope_of(gap, reached)
    steepness = float(slope @ slope)
    if steepness == 0.0:
        return reached
    rest = end - reached
    along = rest - min(float(rest @ slope), 0.0) / steepness * slope
    for share in (1.0, 0.5, 0.25):
        place = reached + share * along
        lacking = floor - gap(place)
        if lacking > 0.0:
            place = place + (lacking + HAIR) / steepness * slope
        place = within(place)
        is_short = np.linalg.norm(place - start) <= np.linalg.norm(end - start)
        if is_short and gap(place) >= floor:
            return place
    return reached


def _until_contact(
    start: NDArray[np.float64], end: NDArray[np.float64], gap: Gap, floor: float
) -> NDArray[np.float64]:
    """Return the last place found before the gap is too small."""
    free, blocked = start, end
    for _ in range(HALVINGS):
        middle = (free + blocked) / 2.0
        if gap(middle) >= floor:
            free = middle
        else:
            blocked = middle
    return free


def slope_of(gap: Gap, place: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the direction in which the gap grows, by how much per unit."""
    here = gap(place)
    steps = np.eye(len(place)) * FEEL
    return np.array([(gap(place + step) - here) / FEEL for step in steps])
