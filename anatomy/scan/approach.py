"""The way into an airway for a straight scope: where it enters and where it points."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from anatomy.redistance import FARTHEST_MM
from anatomy.scan.midplane import Midplane
from renderers.scene.volume import Volume
from system import UserError

RADIUS_MM = 0.6
"""Air around a way. A swollen nose has no room for a scope of 2.7 mm, which pushes
mucosa aside; it can be looked through all the same."""

LONGEST_MM = 100.0
STEP_MM = 0.75

CHECK_MM = 0.1
"""Steps in which a path is checked."""

MIDDLE_MM = 12.0
"""Half width of the slab about the head's midplane that holds the nasal passages."""

MOST_CANDIDATES = 1500

WIDEST_DEG = 40.0
"""Between a way that is tried and the middle of all ways."""

STEEPEST_DEG = 60.0
"""Above the horizontal; a scope held steeper has no upright picture."""

SHORTEST_MM = 20.0
"""A way that one sees less far along is none."""

LONG_MM = 70.0
"""From the nostril to the nasopharynx; a longer way is worth no more."""

DETOUR = 1.0
"""Free way that a place may lack for each millimetre it lies further in front, or
nearer to the middle height: above lie frontal sinuses, below the mouth."""


@dataclass(frozen=True, slots=True)
class Approach:
    """One straight way in.

    pivot_mm: ``(3,)`` LPS point that holds the shaft. axis: ``(3,)`` unit vector
    inwards. free_mm: length from the pivot with air around it.
    """

    pivot_mm: NDArray[np.float64]
    axis: NDArray[np.float64]
    free_mm: float


def approach_from(distance: Volume, pivot_mm: NDArray[np.float64]) -> Approach:
    """Find the longest free way from a point, among those towards the back.

    distance: signed mm to the air surface, negative in air, cubic voxels along the
    patient's axes. Raises UserError for a point outside the volume.
    """
    pivot = np.asarray(pivot_mm, dtype=np.float64)
    low = distance.origin_mm
    high = low + (np.array(distance.shape[::-1]) - 1) * distance.spacing_mm
    if not np.all((pivot >= low) & (pivot <= high)):
        raise UserError(
            f"the pivot {np.round(pivot, 1).tolist()} mm lies outside the imported "
            f"part of the head, which reaches from {np.round(low, 1).tolist()} to "
            f"{np.round(high, 1).tolist()} (patient LPS; of RAS coordinates the first "
            "two change sign)"
        )
    ways = _ways()
    free = _free_lengths(distance, pivot[None], ways)[0]
    best = int(free.argmax())
    return Approach(pivot, ways[best], float(free[best]))


def check_in_air(
    distance: Volume, inner: NDArray[np.bool_], pivot_mm: NDArray[np.float64]
) -> None:
    """Refuse a pivot in tissue, naming the nearest air that a scope can stand in.

    inner: ``(nz, ny, nx)`` mask of the air inside the head, on the distance's grid.
    """
    pivot = np.asarray(pivot_mm, dtype=np.float64)
    if float(distance.sample(pivot)) <= 0:
        return
    told = f"the pivot {np.round(pivot, 1).tolist()} mm lies in tissue"
    places = np.argwhere(inner & (distance.values < -RADIUS_MM))[:, ::-1]
    if not len(places):
        raise UserError(f"{told}, and the scan shows no air for a scope")
    points = distance.origin_mm + places * distance.spacing_mm
    away = np.linalg.norm(points - pivot, axis=1)
    nearest = points[int(away.argmin())]
    raise UserError(
        f"{told}; the nearest air inside the head is {away.min():.1f} mm away: --pivot "
        f"{' '.join(f'{v:.1f}' for v in nearest)}"
    )


def air_reach(
    distance: Volume,
    start_mm: NDArray[np.float64],
    way: NDArray[np.float64],
    most_mm: float,
) -> float:
    """Return how far from a point along a unit vector there is no tissue, in mm.

    Beyond the volume nothing is known to be in the way.
    """
    t = np.arange(0.0, most_mm + CHECK_MM, CHECK_MM)
    points = start_mm + t[:, None] * way
    voxels = (points - distance.origin_mm) / distance.spacing_mm
    top = np.array(distance.shape[::-1]) - 1
    inside = np.all((voxels >= 0) & (voxels <= top), axis=1)
    blocked = inside & (distance.sample(points) >= 0)
    if not blocked.any():
        return most_mm
    return float(max(t[int(blocked.argmax())] - CHECK_MM, 0.0))


def find_approach(
    passages: NDArray[np.bool_], distance: Volume, midplane: Midplane
) -> Approach | None:
    """Find an entrance where no nostril is known: far in front, with a long way in.

    passages: ``(nz, ny, nx)`` mask on the distance's grid, without the sinuses: ways
    that begin or end in one lead nowhere. None where no way beside the midplane is
    `SHORTEST_MM` long.
    """
    closed = np.where(passages, distance.values, np.float32(FARTHEST_MM))
    distance = distance.with_values(closed, FARTHEST_MM)
    places = np.argwhere(closed < -RADIUS_MM)
    spacing = float(distance.spacing_mm[0])
    aside = midplane.aside(distance.origin_mm + places[:, ::-1] * spacing)
    places = places[np.abs(aside) <= MIDDLE_MM]
    if not len(places):
        return None
    # evenly through them, in a fixed order
    places = places[:: max(len(places) // MOST_CANDIDATES, 1)]
    points = distance.origin_mm + places[:, ::-1] * spacing
    ways = _ways()
    free = _free_lengths(distance, points, ways)
    height = np.abs(points[:, 2] - np.median(points[:, 2]))
    longest = free.max(axis=1)
    worth = np.minimum(longest, LONG_MM) - DETOUR * (points[:, 1] + height)
    worth[longest < SHORTEST_MM] = -np.inf
    best = int(worth.argmax())
    if longest[best] < SHORTEST_MM:
        return None
    way = int(free[best].argmax())
    return Approach(points[best], ways[way], float(free[best, way]))


def _ways() -> NDArray[np.float64]:
    """List directions ``(n, 3)`` about the way from the nostril to the recess."""
    middle = np.array([0.0, np.cos(np.radians(35)), np.sin(np.radians(35))])
    up = np.array([0.0, -middle[2], middle[1]])
    side = np.array([1.0, 0.0, 0.0])
    ways = [middle]
    for tilt in np.radians(np.arange(5, WIDEST_DEG + 1, 5)):
        count = max(round(2 * np.pi * np.sin(tilt) / np.radians(7)), 6)
        for turn in 2 * np.pi * np.arange(count) / count:
            aside = np.cos(turn) * side + np.sin(turn) * up
            ways.append(np.cos(tilt) * middle + np.sin(tilt) * aside)
    listed: NDArray[np.float64] = np.array(ways)
    level: NDArray[np.float64] = listed[
        listed[:, 2] <= np.sin(np.radians(STEEPEST_DEG))
    ]
    return level


def _free_lengths(
    distance: Volume, points: NDArray[np.float64], ways: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the free length in mm from each point along each way, ``(n, m)``."""
    spacing = float(distance.spacing_mm[0])
    start = (points - distance.origin_mm) / spacing
    top = np.array(distance.shape[::-1]) - 1
    free = np.zeros((len(points), len(ways)))
    going = np.ones(free.shape, dtype=bool)
    for reached in np.arange(0.0, LONGEST_MM, STEP_MM):
        which, way = np.nonzero(going)
        if not len(which):
            break
        at = np.rint(start[which] + reached / spacing * ways[way]).astype(np.int64)
        inside = np.all((at >= 0) & (at <= top), axis=1)
        at = np.clip(at, 0, top)
        open_ = inside & (distance.values[at[:, 2], at[:, 1], at[:, 0]] < -RADIUS_MM)
        # the pivot itself may lie in a wall that is only just passed
        if reached > 2 * RADIUS_MM:
            going[which[~open_], way[~open_]] = False
        free[which[open_], way[open_]] = reached
    return free
