"""Look at many poses of a tool at once: how deep it lies in walls, what its jaws hold.

A pose is the place of its shaft's end and the shaft's axes, z back up the shaft. A tool
is balls, as `surgery.contact.balls_along` makes them, in that frame.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from surgery.kernels.distance_field import FREE_MM, air_mm, spacing_of
from surgery.kernels.resolve_contact import off_guard

Floats = NDArray[np.float32]
Doubles = NDArray[np.float64]


SQRT3 = math.sqrt(3.0)

AHEAD_MM, DEEPENS_MM, GRADIENT_MM = 0.6, 0.3, 0.4
"""Where tissue does not deepen by the second over the first, the middle of a thin wall
is near: the middle of a ball that got there would come out behind. Its gradient is
taken from places so far off."""

WHOLE_MM = 0.25
"""Tissue so deep counts whole: a film that is thinner than a voxel fills less of it."""

SHAFT_STRIDE = 2
"""Of a straight shaft's balls every second one is enough."""


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _place(origin: Doubles, turn: Doubles, way: Doubles, out: Doubles) -> None:
    for c in range(3):
        out[c] = (
            origin[c] + turn[c, 0] * way[0] + turn[c, 1] * way[1] + turn[c, 2] * way[2]
        )


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _nearest(
    values: NDArray[np.generic], voxel: Doubles, place: Doubles, off: float
) -> float:
    """Return the value of the voxel nearest to a place; `off` beside the grid."""
    i = int(np.rint(voxel[0, :3] @ place + voxel[0, 3]))
    j = int(np.rint(voxel[1, :3] @ place + voxel[1, 3]))
    k = int(np.rint(voxel[2, :3] @ place + voxel[2, 3]))
    nz, ny, nx = values.shape
    if not (0 <= i < nx and 0 <= j < ny and 0 <= k < nz):
        return off
    return float(values[k, j, i])


@njit(cache=True, nogil=True, error_model="numpy")
def is_in_middle(distance: Floats, voxel: Doubles, place: Doubles) -> bool:
    """Return whether a place in tissue is near the middle of a thin wall."""
    x, y, z = place[0], place[1], place[2]
    a = GRADIENT_MM
    into_x = air_mm(distance, voxel, x - a, y, z) - air_mm(distance, voxel, x + a, y, z)
    into_y = air_mm(distance, voxel, x, y - a, z) - air_mm(distance, voxel, x, y + a, z)
    into_z = air_mm(distance, voxel, x, y, z - a) - air_mm(distance, voxel, x, y, z + a)
    length = math.sqrt(into_x**2 + into_y**2 + into_z**2)
    if length < 1e-6:
        return True
    step = AHEAD_MM / length
    ahead = air_mm(
        distance, voxel, x + step * into_x, y + step * into_y, z + step * into_z
    )
    return bool(air_mm(distance, voxel, x, y, z) - ahead < DEEPENS_MM)


class Around(NamedTuple):
    """What is around a tool.

    distance: signed, mm, negative in air; voxel: ``(3, 4)`` of it. walls, grounds: rows
    of the same voxels, and dents: how deep each lets a tool in, mm, by wall and ground.
    guard: of another shaft, as `resolve_contact` takes it. hazards, hazard_voxel:
    distance to what must not be hurt, in steps of unit_mm; no shaft comes nearer than
    clears_mm.
    """

    distance: Floats
    voxel: Doubles
    walls: NDArray[np.uint8]
    grounds: NDArray[np.uint8]
    dents: Doubles
    guard: Doubles
    hazards: NDArray[np.int16]
    hazard_voxel: Doubles
    unit_mm: float
    clears_mm: float


@njit(cache=True, nogil=True, error_model="numpy")
def _deepest(
    around: Around, origin: Doubles, turn: Doubles, back_mm: float, balls: Doubles,
    first_mm: float, last_mm: float, stride: int, most_mm: float,
) -> float:  # fmt: skip
    """Return how deep balls from first_mm to last_mm lie; infinite beyond most_mm.

    And where one lies deeper than its wall yields, or leans on what must not be hurt.
    """
    way, place, aside = np.empty(3), np.empty(3), np.empty(3)
    worst = -math.inf
    for b in range(0, balls.shape[0], stride):
        if not first_mm <= balls[b, 0] <= last_mm:
            continue
        way[0], way[1] = balls[b, 2], balls[b, 3]
        way[2] = balls[b, 4] + balls[b, 0] + back_mm
        _place(origin, turn, way, place)
        radius = balls[b, 1]
        air = air_mm(around.distance, around.voxel, place[0], place[1], place[2])
        deep = radius - air
        if deep > most_mm or off_guard(around.guard, place, aside) < radius:
            return math.inf
        if deep > 0.0:
            row = int(_nearest(around.walls, around.voxel, place, 0.0))
            ground = int(_nearest(around.grounds, around.voxel, place, 0.0))
            if deep > around.dents[row, ground]:
                return math.inf
            if air < 0.0 and is_in_middle(around.distance, around.voxel, place):
                return math.inf
            # what must not be hurt lies below a lining
            steps = _nearest(around.hazards, around.hazard_voxel, place, math.inf)
            if steps * around.unit_mm - radius < around.clears_mm:
                return math.inf
        worst = max(worst, deep)
    return worst


@njit(cache=True, nogil=True, error_model="numpy")
def depths(
    around: Around, origins: Doubles, turns: Doubles, inside_mm: Doubles,
    backs_mm: Doubles, balls: Doubles, end_mm: float, free_mm: float, most_mm: float,
    found: Doubles,
) -> None:  # fmt: skip
    """Write how deep a tool lies in walls on its way in along its own line.

    origins, turns: ``(n, 3)`` and ``(n, 3, 3)`` of the poses; inside_mm: ``(n,)`` from
    the shaft's end to where it comes in; what lies before that does not count.
    backs_mm: ``(m,)`` how far it is drawn back, the outermost first. Of the shaft only
    the last place is looked at that the end gets to: on its way it lies where it will
    lie then; of the end, as long as end_mm, all places are. What is nearer to its end
    than free_mm may lie in tissue. found: ``(n, m)``; where it is deeper than most_mm
    the way ends, there and farther in it is infinite.
    """
    for n in range(origins.shape[0]):
        found[n, :] = math.inf
        reached = -1
        for m in range(backs_mm.shape[0]):
            worst = _deepest(
                around, origins[n], turns[n], backs_mm[m], balls, free_mm,
                min(inside_mm[n] - backs_mm[m], end_mm), 1, most_mm,
            )  # fmt: skip
            if worst > most_mm:
                break
            found[n, m] = worst
            reached = m
        if reached < 0:
            continue
        back_mm = backs_mm[reached]
        shaft = _deepest(
            around, origins[n], turns[n], back_mm, balls, end_mm,
            inside_mm[n] - back_mm, SHAFT_STRIDE, most_mm,
        )  # fmt: skip
        for m in range(reached + 1):
            found[n, m] = max(found[n, m], shaft)


class Head(NamedTuple):
    """What jaws may hold.

    distance: signed, mm, negative in air. labels: what is where. hazards: the distance
    to the nearest, in steps of unit_mm. Each with its voxels from patient mm,
    ``(3, 4)``.
    """

    distance: Floats
    distance_voxel: Doubles
    labels: NDArray[np.uint8]
    label_voxel: Doubles
    hazards: NDArray[np.int16]
    hazard_voxel: Doubles
    unit_mm: float


class Prices(NamedTuple):
    """What jaws are to hold, a label, and what the rest costs.

    costs: ``(256,)`` of a place of other tissue, by its label, from rim_mm before its
    surface on. hurts: of what is nearer to a hazard than spares_mm.
    """

    wanted: int
    costs: Doubles
    hurts: float
    spares_mm: float
    rim_mm: float


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _hurts(head: Head, place: Doubles, radius: float, off_mm: float, h: float) -> bool:
    """Return whether a ball comes nearer to a hazard than off_mm; h: of its voxels."""
    steps = _nearest(head.hazards, head.hazard_voxel, place, math.inf)
    if steps * head.unit_mm - SQRT3 * h - radius >= off_mm:
        # the places between voxels differ by no more
        return False
    near = -air_mm(head.hazards, head.hazard_voxel, place[0], place[1], place[2])
    return near > -FREE_MM and head.unit_mm * near - radius < off_mm


@njit(cache=True, nogil=True, error_model="numpy")
def held_tissue(
    head: Head, origins: Doubles, turns: Doubles, places: Doubles, jaws: Doubles,
    prices: Prices, found: Doubles,
) -> None:  # fmt: skip
    """Write what jaws hold that is wanted, and what that costs, ``(n, 2)``.

    origins, turns: as of `depths`. places: ``(p, 3)`` between jaws; they count one by
    one. jaws: ``(b, 5)`` their balls. Where it costs more than all places are worth the
    rest is not looked at.
    """
    way, place = np.empty(3), np.empty(3)
    off_mm, h = prices.spares_mm, spacing_of(head.hazard_voxel)
    for n in range(origins.shape[0]):
        held = cost = 0.0
        for b in range(jaws.shape[0]):
            way[0], way[1], way[2] = jaws[b, 2], jaws[b, 3], jaws[b, 4] + jaws[b, 0]
            _place(origins[n], turns[n], way, place)
            if _hurts(head, place, jaws[b, 1], off_mm, h):
                cost += prices.hurts
            if cost > places.shape[0]:
                break
        for p in range(places.shape[0]):
            if cost > places.shape[0]:
                break
            _place(origins[n], turns[n], places[p], place)
            if _hurts(head, place, 0.0, off_mm, h):
                cost += prices.hurts
            deep = _nearest(head.distance, head.distance_voxel, place, -1.0)
            if deep <= -prices.rim_mm:
                continue
            label = int(_nearest(head.labels, head.label_voxel, place, 0.0))
            if label == prices.wanted:
                held += min(max(deep / WHOLE_MM, 0.0), 1.0)
            elif deep > 0.0 or prices.costs[label] > 1.0:
                cost += prices.costs[label]
        found[n, 0], found[n, 1] = held, cost
