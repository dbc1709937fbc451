"""Hold a straight tool in front of walls that a hand wants to push it through.

A rigid proxy (Ruspini, Kolarov and Khatib 1997) of a rod: it goes towards the hand's
pose as far as the distance field allows, and slides along what it meets. Two points of
the rod carry its motion, the tip and the one in the nostril; walls push the balls that
it is made of, by position based dynamics (Mueller et al. 2007). Another straight shaft
may be in the way, the scope's beside a tool: it is a wall, too.
"""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from surgery.kernels.distance_field import (
    FREE_MM,
    DistanceField,
    air_mm,
    off_axis,
    slope,
)
from surgery.kernels.touches import BALL, GAP, OUTWARD, PUSH, TOUCH, row_for

Doubles = NDArray[np.float64]

SLIDE_MM = 0.25
"""Longest way along a wall before it is looked at anew. A rod of 1.35 mm leaves a round
wall of its own radius by 0.02 mm on it."""

NEAR_MM = 0.02
"""Walls hold a rod this much before the depth allowed: what a slide may err by."""

SWEEPS, SETTLED_MM = 40, 1e-5
"""Times that pushes of several walls are reconciled, at most, and until they settle."""

EVEN_MM = 1e-3
"""Gaps that differ by less are alike."""

BETWEEN = 8
"""Balls along a wall of which one is enough."""

MOST_TOUCHES = 24
"""Walls that push at the same time; the deepest ones do."""


@njit(cache=True, nogil=True, error_model="numpy")
def _off_grid(field: DistanceField, place: Doubles, radius: float) -> float:
    """Return how far a ball off the grid may go, mm, without a look.

    Either to the grid, or as the air at the grid's nearest place lets it.
    """
    distance, voxel, h = field.distance, field.voxel, field.h
    square = 0.0
    at = np.empty(3)
    for c in range(3):
        u = voxel[c, 3]
        for e in range(3):
            u += voxel[c, e] * place[e]
        at[c] = min(max(u, 0.0), distance.shape[2 - c] - 1.0)
        square += (u - at[c]) ** 2
    away = h * math.sqrt(square)
    i, j, k = int(at[0] + 0.5), int(at[1] + 0.5), int(at[2] + 0.5)
    free: float = max(away, -distance[k, j, i] - h - radius - away)
    return free


@njit(cache=True, nogil=True, error_model="numpy")
def off_guard(guard: Doubles, place: Doubles, out: Doubles) -> float:
    """Return the way from another shaft's surface, mm; write the direction off it.

    guard: ``(7,)`` the shaft's ends and its radius; none is given a negative one.
    """
    if guard[6] < 0.0:
        return math.inf
    out[0], out[1], out[2] = off_axis(guard, place[0], place[1], place[2])
    off = math.sqrt(out[0] * out[0] + out[1] * out[1] + out[2] * out[2])
    if off > 0.0:
        out /= off
    free: float = off - guard[6]
    return free


@njit(cache=True, nogil=True, error_model="numpy")
def _ball(rod: Doubles, lever: float, balls: Doubles, n: int, out: Doubles) -> None:
    """Write the place of a ball. rod: tip and nostril point, six numbers."""
    share = balls[n, 0] / lever
    for c in range(3):
        out[c] = rod[c] + share * (rod[3 + c] - rod[c]) + balls[n, 2 + c]


@njit(cache=True, nogil=True, error_model="numpy")
def _gaps(
    field: DistanceField, guard: Doubles, rod: Doubles, lever: float, balls: Doubles,
    grown: Doubles, gaps: Doubles,
) -> float:  # fmt: skip
    """Write the free way around each ball, mm; returns the least gap to tissue.

    A shaft in the way pushes, but never into tissue: it is left out of the least. Off
    the grid there is no tissue, but the way to the grid is all that is known.
    """
    distance, voxel = field.distance, field.voxel
    place, aside = np.empty(3), np.empty(3)
    least = math.inf
    for n in range(balls.shape[0]):
        _ball(rod, lever, balls, n, place)
        radius = balls[n, 1] + grown[n]
        air = air_mm(distance, voxel, place[0], place[1], place[2])
        gaps[n] = air - radius
        if gaps[n] < FREE_MM:
            least = min(least, gaps[n])
        else:
            gaps[n] = _off_grid(field, place, radius)
        free = off_guard(guard, place, aside) - balls[n, 1]
        gaps[n] = min(gaps[n], free)
    return least


@njit(cache=True, nogil=True, error_model="numpy")
def _outward(
    field: DistanceField, guard: Doubles, place: Doubles, grown: float, out: Doubles
) -> bool:
    """Write the unit direction into the air; False where there is none."""
    x, y, z = place[0], place[1], place[2]
    air = air_mm(field.distance, field.voxel, x, y, z)
    if off_guard(guard, place, out) < air - grown:
        return True
    total = slope(field, x, y, z, out)
    if total == 0.0:
        return False
    out /= math.sqrt(total)
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def _touches(
    field: DistanceField, guard: Doubles, rod: Doubles, lever: float, balls: Doubles,
    grown: Doubles, gaps: Doubles, limit: float, found: Doubles,
) -> int:  # fmt: skip
    """Write the deepest balls below a limit; returns their number.

    found: ``(MOST_TOUCHES, TOUCH)``. A ball whose neighbour is deeper says nothing new;
    of those that lie along a wall some do, the ends among them.
    """
    count = 0
    told = -MOST_TOUCHES
    place, out = np.empty(3), np.empty(3)
    last = balls.shape[0] - 1
    for n in range(balls.shape[0]):
        if gaps[n] > limit:
            continue
        if (n > 0 and gaps[n - 1] < gaps[n] - EVEN_MM) or (
            n < last and gaps[n + 1] < gaps[n] - EVEN_MM
        ):
            continue
        is_end = n == last or gaps[n + 1] > limit
        if n - told < BETWEEN and not is_end:
            continue
        told = n
        at = row_for(found, count, gaps[n])
        if at < 0:
            continue
        _ball(rod, lever, balls, n, place)
        if not _outward(field, guard, place, grown[n], out):
            continue
        found[at, BALL], found[at, GAP], found[at, PUSH] = n, gaps[n], 0.0
        found[at, OUTWARD : OUTWARD + 3] = out
        count = max(count, at + 1)
    return count


@njit(cache=True, nogil=True, error_model="numpy")
def _turn_aside(
    way: Doubles, touches: Doubles, count: int, lever: float, balls: Doubles,
    soft: float, give: float,
) -> bool:  # fmt: skip
    """Change a way of tip and nostril point so that no touching ball goes deeper.

    soft: how readily the shaft in the nostril gives way; the tip does by 1. Returns
    whether the way was changed.
    """
    is_changed = False
    for _ in range(SWEEPS):
        most = 0.0
        for m in range(count):
            b = balls[int(touches[m, BALL]), 0] / lever
            a = 1.0 - b
            speed = 0.0
            for c in range(3):
                speed += touches[m, OUTWARD + c] * (a * way[c] + b * way[3 + c])
            lacking = min(-(touches[m, GAP] + give), SLIDE_MM) - speed
            # a wall pushes and never pulls, but may push less than it did before
            push = max(touches[m, PUSH] + lacking / (a * a + soft * b * b), 0.0)
            change = push - touches[m, PUSH]
            if change == 0.0:
                continue
            touches[m, PUSH] = push
            is_changed = True
            most = max(most, abs(change))
            for c in range(3):
                way[c] += change * a * touches[m, OUTWARD + c]
                way[3 + c] += change * soft * b * touches[m, OUTWARD + c]
        if most < SETTLED_MM:
            break
    return is_changed


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _straighten(rod: Doubles, lever: float) -> None:
    """Bring the nostril point back to its distance from the tip."""
    x, y, z = rod[3] - rod[0], rod[4] - rod[1], rod[5] - rod[2]
    scale = lever / math.sqrt(x * x + y * y + z * z)
    rod[3] = rod[0] + scale * x
    rod[4] = rod[1] + scale * y
    rod[5] = rod[2] + scale * z


@njit(cache=True, nogil=True, error_model="numpy")
def resolve_contact(
    field: DistanceField, guard: Doubles, balls: Doubles, grown: Doubles, lever: float,
    rod: Doubles, wanted: Doubles, give: float, soft: float, iterations: int,
) -> float:  # fmt: skip
    """Move a rod towards where it is wanted, not deeper into tissue than `give`.

    guard: ``(7,)`` ends and radius of another shaft in the way, a negative radius for
    none. balls: ``(n, 5)`` way from the tip along the rod and radius, mm, in order, and
    how far off the rod's line it lies, in patient axes; a turn of the rod does not turn
    that. grown: ``(n,)`` how much thicker a ball is for tissue, mm; for the guard it is
    as thick as it is. lever: from the tip to the point in the nostril, mm. rod:
    ``(6,)`` tip and that point, changed in place. wanted: ``(6,)``.

    Returns the least gap, mm. It is at least -give, or that of the start where it
    began deeper.
    """
    gaps = np.empty(balls.shape[0])
    found = np.empty((MOST_TOUCHES, TOUCH))
    way, trial = np.empty(6), np.empty(6)
    least = _gaps(field, guard, rod, lever, balls, grown, gaps)
    best, held = rod.copy(), least
    for _ in range(iterations):
        size = 0.0
        for c in range(6):
            way[c] = wanted[c] - rod[c]
            size = max(size, abs(way[c]))
        if size < 1e-9 and least >= -give:
            break
        is_whole = least >= -give
        if not is_whole:
            # out first, then on
            way[:] = 0.0
        limit = SLIDE_MM - give
        count = _touches(field, guard, rod, lever, balls, grown, gaps, limit, found)
        if _turn_aside(way, found, count, lever, balls, soft, give - NEAR_MM):
            is_whole = False
        # no farther than one may without looking
        free = math.inf
        for n in range(balls.shape[0]):
            b = balls[n, 0] / lever
            m = 0.0
            for c in range(3):
                m += ((1.0 - b) * way[c] + b * way[3 + c]) ** 2
            m = math.sqrt(m)
            if m > 0.0:
                free = min(free, max(gaps[n] + give, SLIDE_MM) / m)
        if free < 1.0:
            way *= free
            is_whole = False
        size = 0.0
        for c in range(6):
            trial[c] = rod[c] + way[c]
            size = max(size, abs(way[c]))
        _straighten(trial, lever)
        rod[:] = wanted if is_whole else trial
        least = _gaps(field, guard, rod, lever, balls, grown, gaps)
        if least >= min(-give, held):
            best[:], held = rod, least
        if size < 1e-6:
            break
    rod[:] = best
    return held
