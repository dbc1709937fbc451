"""Hold a straight tool in front of walls that a hand wants to push it through.

A rigid proxy (Ruspini, Kolarov and Khatib 1997) of a rod: it goes towards the hand's
pose as far as the distance field allows, and slides along what it meets. Two points of
the rod carry its motion, the tip and the one in the nostril; walls push the balls that
it is made of, by position based dynamics (Mueller et al. 2007). Another straight shaft
may be in the way, the scope's beside a tool: it is a wall, too.
"""

import math
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float32]
Doubles = NDArray[np.float64]

SLIDE_MM = 0.25
"""Longest way along a wall before it is looked at anew. A rod of 1.35 mm leaves a round
wall of its own radius by 0.02 mm on it."""

NEAR_MM = 0.02
"""Walls hold a rod this much before the depth allowed: what a slide may err by."""

FREE_MM = 500.0
"""What is told as air off the grid is more."""

SWEEPS, SETTLED_MM = 40, 1e-5
"""Times that pushes of several walls are reconciled, at most, and until they settle."""

EVEN_MM = 1e-3
"""Gaps that differ by less are alike."""

BETWEEN = 8
"""Balls along a wall of which one is enough."""

MOST_TOUCHES = 24
"""Walls that push at the same time; the deepest ones do."""


@njit(cache=True, nogil=True, error_model="numpy")
def air_mm(
    distance: NDArray[Any], voxel: Doubles, x: float, y: float, z: float
) -> float:
    """Interpolate how far a place is from tissue, mm; off the grid is air.

    voxel: ``(3, 4)`` voxels from patient mm.
    """
    nz, ny, nx = distance.shape
    u = voxel[0, 0] * x + voxel[0, 1] * y + voxel[0, 2] * z + voxel[0, 3]
    v = voxel[1, 0] * x + voxel[1, 1] * y + voxel[1, 2] * z + voxel[1, 3]
    w = voxel[2, 0] * x + voxel[2, 1] * y + voxel[2, 2] * z + voxel[2, 3]
    if not (0 <= u <= nx - 1 and 0 <= v <= ny - 1 and 0 <= w <= nz - 1):
        return 2.0 * FREE_MM
    i, j, k = min(int(u), nx - 2), min(int(v), ny - 2), min(int(w), nz - 2)
    u, v, w = u - i, v - j, w - k
    near, far = distance[k], distance[k + 1]
    a = near[j, i] + u * (near[j, i + 1] - near[j, i])
    b = near[j + 1, i] + u * (near[j + 1, i + 1] - near[j + 1, i])
    c = far[j, i] + u * (far[j, i + 1] - far[j, i])
    d = far[j + 1, i] + u * (far[j + 1, i + 1] - far[j + 1, i])
    p = a + v * (b - a)
    q = c + v * (d - c)
    tissue: float = p + w * (q - p)
    return -tissue


@njit(cache=True, nogil=True, error_model="numpy")
def _off_grid(
    distance: Floats, voxel: Doubles, h: float, place: Doubles, radius: float
) -> float:
    """Return how far a ball off the grid may go, mm, without a look.

    Either to the grid, or as the air at the grid's nearest place lets it.
    """
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
    along = length = 0.0
    for c in range(3):
        way = guard[3 + c] - guard[c]
        along += (place[c] - guard[c]) * way
        length += way * way
    share = min(max(along / length, 0.0), 1.0)
    off = 0.0
    for c in range(3):
        out[c] = place[c] - guard[c] - share * (guard[3 + c] - guard[c])
        off += out[c] * out[c]
    off = math.sqrt(off)
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
    distance: Floats, voxel: Doubles, h: float, guard: Doubles, rod: Doubles,
    lever: float, balls: Doubles, grown: Doubles, gaps: Doubles,
) -> float:  # fmt: skip
    """Write the free way around each ball, mm; returns the least gap to tissue.

    A shaft in the way pushes, but never into tissue: it is left out of the least. Off
    the grid there is no tissue, but the way to the grid is all that is known.
    """
    place, aside = np.empty(3), np.empty(3)
    least = math.inf
    for n in range(balls.shape[0]):
        _ball(rod, lever, balls, n, place)
        radius = balls[n, 1] + grown[n]
        gaps[n] = air_mm(distance, voxel, place[0], place[1], place[2]) - radius
        if gaps[n] < FREE_MM:
            least = min(least, gaps[n])
        else:
            gaps[n] = _off_grid(distance, voxel, h, place, radius)
        free = off_guard(guard, place, aside) - balls[n, 1]
        gaps[n] = min(gaps[n], free)
    return least


@njit(cache=True, nogil=True, error_model="numpy")
def _outward(
    distance: Floats, voxel: Doubles, h: float, guard: Doubles, place: Doubles,
    grown: float, out: Doubles,
) -> bool:  # fmt: skip
    """Write the unit direction into the air; False where there is none."""
    total = 0.0
    air = air_mm(distance, voxel, place[0], place[1], place[2])
    if off_guard(guard, place, out) < air - grown:
        return True
    for c in range(3):
        ahead = place.copy()
        behind = place.copy()
        ahead[c] += h
        behind[c] -= h
        a = air_mm(distance, voxel, ahead[0], ahead[1], ahead[2])
        b = air_mm(distance, voxel, behind[0], behind[1], behind[2])
        # at the grid's rim there is no slope to be had
        out[c] = a - b if max(a, b) < FREE_MM else 0.0
        total += out[c] * out[c]
    if total < 1e-12:
        return False
    out /= math.sqrt(total)
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def _touches(
    distance: Floats, voxel: Doubles, h: float, guard: Doubles, rod: Doubles,
    lever: float, balls: Doubles, grown: Doubles, gaps: Doubles, limit: float,
    found: Doubles,
) -> int:  # fmt: skip
    """Write the deepest balls below a limit: number, gap, direction outwards.

    found: ``(MOST_TOUCHES, 5)``. A ball whose neighbour is deeper says nothing new; of
    those that lie along a wall some do, the ends among them.
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
        at = count
        if count == MOST_TOUCHES:
            at = 0
            for m in range(1, count):
                if found[m, 1] > found[at, 1]:
                    at = m
            if found[at, 1] <= gaps[n]:
                continue
        _ball(rod, lever, balls, n, place)
        if not _outward(distance, voxel, h, guard, place, grown[n], out):
            continue
        found[at, 0], found[at, 1] = n, gaps[n]
        found[at, 2:5] = out
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
    pushes = np.zeros(count)
    for _ in range(SWEEPS):
        most = 0.0
        for m in range(count):
            b = balls[int(touches[m, 0]), 0] / lever
            a = 1.0 - b
            speed = 0.0
            for c in range(3):
                speed += touches[m, 2 + c] * (a * way[c] + b * way[3 + c])
            lacking = min(-(touches[m, 1] + give), SLIDE_MM) - speed
            # a wall pushes and never pulls, but may push less than it did before
            push = max(pushes[m] + lacking / (a * a + soft * b * b), 0.0)
            push, pushes[m] = push - pushes[m], push
            if push == 0.0:
                continue
            is_changed = True
            most = max(most, abs(push))
            for c in range(3):
                way[c] += push * a * touches[m, 2 + c]
                way[3 + c] += push * soft * b * touches[m, 2 + c]
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
def hold_back(
    distance: Floats, voxel: Doubles, h: float, guard: Doubles, balls: Doubles,
    grown: Doubles, lever: float, rod: Doubles, wanted: Doubles, give: float,
    soft: float, iterations: int,
) -> float:  # fmt: skip
    """Move a rod towards where it is wanted, not deeper into tissue than `give`.

    distance: signed, mm, negative in air; h: its spacing. guard: ``(7,)`` ends and
    radius of another shaft in the way, a negative radius for none. balls: ``(n, 5)``
    way from the tip along the rod and radius, mm, in order, and how far off the rod's
    line it lies, in patient axes; a turn of the rod does not turn that. grown: ``(n,)``
    how much thicker a ball is for tissue, mm; for the guard it is as thick as it is.
    lever: from the tip to the point in the nostril, mm. rod: ``(6,)`` tip and that
    point, changed in place. wanted: ``(6,)``.

    Returns the least gap, mm. It is at least -give, or that of the start where it
    began deeper.
    """
    gaps = np.empty(balls.shape[0])
    found = np.empty((MOST_TOUCHES, 5))
    way, trial = np.empty(6), np.empty(6)
    least = _gaps(distance, voxel, h, guard, rod, lever, balls, grown, gaps)
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
        count = _touches(
            distance, voxel, h, guard, rod, lever, balls, grown, gaps, SLIDE_MM - give,
            found,
        )  # fmt: skip
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
        least = _gaps(distance, voxel, h, guard, rod, lever, balls, grown, gaps)
        if least >= min(-give, held):
            best[:], held = rod, least
        if size < 1e-6:
            break
    rod[:] = best
    return held
