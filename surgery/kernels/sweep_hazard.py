"""Follow a tool's way past a hazard, however fast: its nearest place, and its entry.

The way between two samples is halved until no part can pass anything unseen. Let a
distance change by at most L mm per mm. Between two places w apart, with distances a and
b, none is then less than (a + b - L w) / 2 (Piyavskii 1972). L is measured for entries,
which must not be missed; for nearest approaches it is that of a true distance.
"""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from anatomy.kernels.wall_depth import wall_depth
from renderers.scene.kernels.least_along import value_at
from surgery.kernels.distance_field import affine, lerp, to_voxel_inside
from surgery.kernels.solid_distance import solids_distance

Shorts = NDArray[np.int16]
Bytes = NDArray[np.uint8]
Floats = NDArray[np.float32]
Doubles = NDArray[np.float64]

TOL_MM = 0.05
"""Half of how far a nearest approach may be off."""

SLOPE = 1.25
"""A true distance changes by 1 mm per mm; interpolated near edges, by a little more."""

BEYOND_MM = 1.0
"""A gap that is this much larger than what matters need not be known."""

FINE_MM = 0.1
"""Shortest part of a way that is looked at, once something was met on it."""

OPEN_MM = -0.05
"""A tool that is deeper than this inside a hazard has entered it. Rounding of stored
distances is a tenth of it."""

CLOSE_MM = 0.5
"""A tool has left a hazard again when it is this far away from it. A hand's tremor is a
fifth, so that an entry is counted once."""

ALONG_MM = 0.25
"""Between places of a tool's axis at which a hazard's cover is looked at."""

DEEP_MM = 1.0
"""Deeper inside a hazard its distance may change more per mm than `steepest` says: an
entry is never missed, only its depth may be less exact."""

COVER_MM = 0.1
"""A wall's bone is through where the depth is so close to mucosa and bone together."""

LEAST_BOX_MM = 0.06
"""Half the diagonal of the smallest box of a cut that is looked at by itself."""

STEEPEST, ROUGHEST_MM = 2.0, 1.0
"""Bounds of how much an interpolated distance changes per mm, and of how rough a
solid is."""

LOW, LOW_TRUE, INSIDE, DEEPEST, STATE = 0, 1, 2, 3, 4
"""Columns of a state, and their number: bounds of the gap at the last sample, by the
measured slope and by `SLOPE`, mm; 1 while the tool is inside; the least gap of that
stay."""

TIME, GAP, PLACE, DEPTH, EVENT = 0, 1, 2, 5, 6
"""Columns of an event, and their number: share of the way; gap there, mm; the tool's
place nearest to the hazard, patient frame, three columns; depth of the whole stay."""

NEAREST, STAY, OPENED = 0, 1, 2
"""Rows of events: the nearest approach; the stay that has lasted; new stays follow."""


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def hazard_mm(
    values: Shorts, voxel: Doubles, unit: float, x: float, y: float, z: float
) -> float:
    """Interpolate a hazard's distance, mm.

    voxel: ``(3, 4)`` voxels from patient mm. Off the grid it is that of the grid's
    nearest place, so that a tool that comes in meets no jump.
    """
    u, v, w = to_voxel_inside(values.shape, voxel, x, y, z)
    return unit * lerp(values, u, v, w)


@njit(cache=True, nogil=True, error_model="numpy")
def depth_mm(values: Floats, voxel: Doubles, x: float, y: float, z: float) -> float:
    """Interpolate the depth below the air's surface, mm; off the grid is air."""
    nz, ny, nx = values.shape
    u, v, w = affine(voxel, x, y, z)
    if not (0 <= u <= nx - 1 and 0 <= v <= ny - 1 and 0 <= w <= nz - 1):
        return -1.0
    return value_at(values, u, v, w)


@njit(cache=True, nogil=True, error_model="numpy")
def _depth_in_wall(
    values: Floats, voxel: Doubles, x: float, y: float, z: float
) -> float:
    """Return the depth as `depth_mm` does, and in the middle of a thin wall all of it.

    Interpolation alone would never find such a wall's bone to be passed.
    """
    depth = depth_mm(values, voxel, x, y, z)
    spacing = np.empty(3)
    for axis in range(3):
        a, b, c, _ = voxel[axis]
        spacing[axis] = 1.0 / math.sqrt(a * a + b * b + c * c)
    u, v, w = affine(voxel, x, y, z)
    return wall_depth(values, spacing, u, v, w, depth)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _drop(a: int, b: int, floor: int) -> float:
    """Return how far apart two values are, none of them below a floor."""
    return abs(float(max(a, floor) - max(b, floor)))


@njit(cache=True, nogil=True, error_model="numpy")
def steepest(values: Shorts, spacing: Doubles, unit: float) -> float:
    """Return the most that interpolated values change per mm, at least 1.

    In each cell the bound is made of its largest difference along each axis. What lies
    deeper than `DEEP_MM` counts as that deep: where air cuts off a structure its
    distance may drop from nothing to anything at once.
    """
    floor = int(-DEEP_MM / unit)
    nz, ny, nx = values.shape
    most = 1.0
    for k in range(nz - 1):
        for j in range(ny - 1):
            for i in range(nx - 1):
                ax = ay = az = 0.0
                for corner in range(4):
                    f, g = corner & 1, corner >> 1
                    x = _drop(
                        values[k + g, j + f, i + 1], values[k + g, j + f, i], floor
                    )
                    y = _drop(
                        values[k + g, j + 1, i + f], values[k + g, j, i + f], floor
                    )
                    z = _drop(
                        values[k + 1, j + g, i + f], values[k, j + g, i + f], floor
                    )
                    ax, ay, az = max(ax, x), max(ay, y), max(az, z)
                ax *= unit / spacing[0]
                ay *= unit / spacing[1]
                az *= unit / spacing[2]
                most = max(most, ax * ax + ay * ay + az * az)
    return math.sqrt(most)


@njit(cache=True, nogil=True, error_model="numpy")
def _place(before: Doubles, after: Doubles, n: int, t: float, out: Doubles) -> float:
    """Write a capsule's ends at a share of the way, six numbers; returns its length."""
    for c in range(6):
        out[c] = before[n, c] + t * (after[n, c] - before[n, c])
    x, y, z = out[3] - out[0], out[4] - out[1], out[5] - out[2]
    return math.sqrt(x * x + y * y + z * z)


@njit(cache=True, nogil=True, error_model="numpy")
def _off_grid_mm(values: Shorts, voxel: Doubles, x: float, y: float, z: float) -> float:
    """Return how far a place is from the grid, mm; 0 within."""
    square = 0.0
    for axis in range(3):
        a, b, c, shift = voxel[axis]
        u = a * x + b * y + c * z + shift
        u -= min(max(u, 0.0), values.shape[2 - axis] - 1.0)
        square += u * u / (a * a + b * b + c * c)
    return math.sqrt(square)


@njit(cache=True, nogil=True, error_model="numpy")
def _away_mm(
    values: Shorts, voxel: Doubles, bottom: float, before: Doubles, after: Doubles,
    t: float,
) -> float:  # fmt: skip
    """Return a gap that capsules surely keep, mm: the hazard lies within the grid.

    A tool that is far from the head is known so by one look.
    """
    ends = np.empty(6)
    least = math.inf
    for n in range(before.shape[0]):
        length = _place(before, after, n, t, ends)
        away = _off_grid_mm(
            values, voxel, 0.5 * (ends[0] + ends[3]), 0.5 * (ends[1] + ends[4]),
            0.5 * (ends[2] + ends[5]),
        )  # fmt: skip
        least = min(least, away + bottom - 0.5 * length - before[n, 6])
    return least


@njit(cache=True, nogil=True, error_model="numpy")
def _least(
    values: Shorts, voxel: Doubles, grid: tuple[float, float, float], before: Doubles,
    after: Doubles, t: float, cap: float, found: Doubles,
) -> float:  # fmt: skip
    """Return the gap between capsules and a hazard, mm; `cap` or more if not less.

    At most `TOL_MM` too large. grid: unit of the values, how steep they are, and the
    least of them, mm. t: share of the way. found: ``(4,)`` number of the capsule, place
    of its axis.
    """
    unit, steep, bottom = grid
    ends = np.empty(6)
    best = cap
    away = _away_mm(values, voxel, min(bottom, 0.0), before, after, t)
    if away >= cap:
        return away
    for n in range(before.shape[0]):
        length = _place(before, after, n, t, ends)
        radius = before[n, 6]
        s = last = step = 0.0
        while True:
            share = s / length if length > 0.0 else 0.0
            x = ends[0] + share * (ends[3] - ends[0])
            y = ends[1] + share * (ends[4] - ends[1])
            z = ends[2] + share * (ends[5] - ends[2])
            here = hazard_mm(values, voxel, unit, x, y, z) - radius
            floor = min(best, here) - TOL_MM
            # what is in already cannot enter: then only its depth is looked for
            entry = OPEN_MM - TOL_MM if min(best, here) >= OPEN_MM else -math.inf
            both = last + here
            if step > 0.0 and (
                0.5 * (both - steep * step) < entry
                or 0.5 * (both - SLOPE * step) < floor
            ):
                # something lower may lie between: look closer
                sure = min((last - entry) / steep, (last - floor) / SLOPE)
                if step > 1.000001 * sure:
                    s -= step
                    step = max(0.5 * step, sure)
                    s += step
                    continue
            if here < best:
                best = here
                found[0], found[1], found[2], found[3] = n, x, y, z
            if s >= length or best - TOL_MM <= bottom - radius:
                # nothing is deeper
                break
            last = here
            step = 2.0 * min((here - entry) / steep, (here - floor) / SLOPE)
            if s + step >= length:
                step = length - s
                s = length
            else:
                s += step
    return best


@njit(cache=True, nogil=True, error_model="numpy")
def _towards(
    values: Shorts, voxel: Doubles, unit: float, place: Doubles, out: Doubles
) -> None:
    """Write the unit direction from a place to the hazard, by central differences."""
    h = 0.25
    x, y, z = place[0], place[1], place[2]
    a = hazard_mm(values, voxel, unit, x - h, y, z)
    b = hazard_mm(values, voxel, unit, x + h, y, z)
    out[0] = a - b
    a = hazard_mm(values, voxel, unit, x, y - h, z)
    b = hazard_mm(values, voxel, unit, x, y + h, z)
    out[1] = a - b
    a = hazard_mm(values, voxel, unit, x, y, z - h)
    b = hazard_mm(values, voxel, unit, x, y, z + h)
    out[2] = a - b
    size = math.sqrt(out[0] * out[0] + out[1] * out[1] + out[2] * out[2])
    if size > 0.0:
        out /= size


@njit(cache=True, nogil=True, error_model="numpy")
def plate_mm(
    wall: Bytes, thickness: Floats, voxel: Doubles, x: float, y: float, z: float
) -> float:
    """Return mucosa and bone together of the wall that a place belongs to, mm."""
    nz, ny, nx = wall.shape
    u = voxel[0, 0] * x + voxel[0, 1] * y + voxel[0, 2] * z + voxel[0, 3]
    v = voxel[1, 0] * x + voxel[1, 1] * y + voxel[1, 2] * z + voxel[1, 3]
    w = voxel[2, 0] * x + voxel[2, 1] * y + voxel[2, 2] * z + voxel[2, 3]
    i = min(max(int(u + 0.5), 0), nx - 1)
    j = min(max(int(v + 0.5), 0), ny - 1)
    k = min(max(int(w + 0.5), 0), nz - 1)
    row = wall[k, j, i]
    total: float = thickness[row, 0] + thickness[row, 1]
    return total


@njit(cache=True, nogil=True, error_model="numpy")
def _is_covered(
    pristine: Floats, wall: Bytes, thickness: Floats, voxel: Doubles, p: Doubles,
    inward: Doubles,
) -> bool:  # fmt: skip
    """Return whether what a tool has reached still has its bone before it.

    p: the tool's foremost place; inward: direction to the hazard. A thin plate is
    through, too, where the tool is past its middle: it is nearer to the air beyond.
    """
    depth = _depth_in_wall(pristine, voxel, p[0], p[1], p[2])
    if depth <= 0.0:
        return True
    if depth >= plate_mm(wall, thickness, voxel, p[0], p[1], p[2]) - COVER_MM:
        return False
    h = ALONG_MM
    before = _depth_in_wall(
        pristine, voxel, p[0] - h * inward[0], p[1] - h * inward[1],
        p[2] - h * inward[2],
    )  # fmt: skip
    return before < depth


@njit(cache=True, nogil=True, error_model="numpy")
def _foremost(
    values: Shorts, voxel: Doubles, unit: float, axis: Doubles, radius: float,
    p: Doubles, inward: Doubles,
) -> None:  # fmt: skip
    """Write the place of a ball that is nearest to the hazard, and the direction."""
    _towards(values, voxel, unit, axis, inward)
    for c in range(3):
        p[c] = axis[c] + radius * inward[c]


@njit(cache=True, nogil=True, error_model="numpy")
def _uncovered(
    values: Shorts, voxel: Doubles, grid: tuple[float, float, float], before: Doubles,
    after: Doubles, t: float, head: tuple[Floats, Bytes, Floats, Doubles],
    event: Doubles,
) -> float:  # fmt: skip
    """Return the least gap of the places that have no bone before them; +inf for none.

    event: gets its place. head: pristine distance, walls, thicknesses, ``(3, 4)``
    voxels from mm.
    """
    pristine, wall, thickness, head_voxel = head
    unit = grid[0]
    ends = np.empty(6)
    axis = np.empty(3)
    p = np.empty(3)
    inward = np.empty(3)
    best = math.inf
    for n in range(before.shape[0]):
        length = _place(before, after, n, t, ends)
        count = math.ceil(length / ALONG_MM) + 1
        for m in range(count):
            share = m / (count - 1) if count > 1 else 0.0
            for c in range(3):
                axis[c] = ends[c] + share * (ends[3 + c] - ends[c])
            here = hazard_mm(values, voxel, unit, axis[0], axis[1], axis[2])
            here -= before[n, 6]
            if here >= OPEN_MM or here >= best:
                continue
            _foremost(values, voxel, unit, axis, before[n, 6], p, inward)
            if _is_covered(pristine, wall, thickness, head_voxel, p, inward):
                continue
            best = here
            event[PLACE : PLACE + 3] = p
    return best


@njit(cache=True, nogil=True, error_model="numpy")
def _fastest(before: Doubles, after: Doubles) -> float:
    """Return the longest way of a capsule's end, mm."""
    most = 0.0
    for n in range(before.shape[0]):
        for end in (0, 3):
            x = after[n, end] - before[n, end]
            y = after[n, end + 1] - before[n, end + 1]
            z = after[n, end + 2] - before[n, end + 2]
            most = max(most, x * x + y * y + z * z)
    return math.sqrt(most)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _may_hide(
    a: float, a_true: float, b: float, way: float, steep: float, bottom: float,
    nearest: float, inside: bool, deepest: float,
) -> bool:  # fmt: skip
    """Return whether something may be met between two places that is not known yet.

    a, b: lower bounds of the gap at either end, a_true that by `SLOPE`. way: between
    them, mm. bottom: no gap is less.
    """
    least = max(0.5 * (a_true + b - SLOPE * way), bottom)
    if least < nearest - TOL_MM and way > 0.5 * TOL_MM:
        return True
    if inside:
        if least < deepest - TOL_MM and way > 0.5 * TOL_MM:
            return True
        return max(a, b) + steep * way > CLOSE_MM and way > FINE_MM
    if 0.5 * (a + b - steep * way) >= OPEN_MM - TOL_MM:
        return False
    # a tool that is in already is followed in even parts
    finest = TOL_MM / steep if b >= OPEN_MM else FINE_MM
    return way > finest


@njit(cache=True, nogil=True, error_model="numpy")
def follow(
    values: Shorts, voxel: Doubles, grid: tuple[float, float, float],
    head: tuple[Floats, Bytes, Floats, Doubles], before: Doubles, after: Doubles,
    state: Doubles, nearest: float, events: Doubles,
) -> int:  # fmt: skip
    """Follow capsules from one sample to the next; returns the number of rows written.

    values: int16 hazard distances, in units of grid[0] mm; grid[1]: how steep they
    are; grid[2]: the least of them, mm; voxel: ``(3, 4)`` voxels from mm. head:
    of `_uncovered`. before, after: ``(n, 7)`` ends and radius, mm. state: ``(4,)``,
    see `LOW`; -inf for a tool that comes anew. nearest: least gap so far. events:
    ``(m, 6)``; the row `NEAREST` has a gap of +inf, and `STAY` a depth of zero, where
    nothing is to be told.
    """
    found, event = np.empty(4), np.empty(EVENT)
    inward, p = np.empty(3), np.empty(3)
    steep = grid[1]
    bottom = grid[2] - np.max(before[:, 6])
    speed = _fastest(before, after)
    low, low_true = state[LOW], state[LOW_TRUE]
    inside, deepest = state[INSIDE] > 0.0, state[DEEPEST]
    events[NEAREST, GAP] = math.inf
    events[STAY, DEPTH] = 0.0
    rows, current = OPENED, STAY
    is_far = not inside and low_true - SLOPE * speed >= nearest - TOL_MM
    if is_far and low - steep * speed >= OPEN_MM:
        state[LOW], state[LOW_TRUE] = low - steep * speed, low_true - SLOPE * speed
        return rows
    # right ends of parts of the way, the next one on top, with the gaps there
    ends = np.empty((80, 2))
    top = 0
    ends[0, 0] = 1.0 if low > -math.inf else 0.0
    is_new = True
    exact = False
    t = 0.0
    while True:
        until = ends[top, 0]
        if is_new:
            cap = max(nearest, CLOSE_MM) + BEYOND_MM
            gap = _least(values, voxel, grid, before, after, until, cap, found)
            ends[top, 1] = gap
            if gap < nearest:
                nearest = gap
                _foremost(
                    values, voxel, grid[0], found[1:], before[int(found[0]), 6], p,
                    inward,
                )  # fmt: skip
                events[NEAREST, TIME], events[NEAREST, GAP] = until, gap
                events[NEAREST, PLACE : PLACE + 3] = p
        gap = ends[top, 1]
        way = (until - t) * speed
        if (
            until > t
            and top < 78
            and _may_hide(
                low,
                low_true,
                gap - TOL_MM,
                way,
                steep,
                bottom,
                nearest,
                inside,
                deepest,
            )
        ):
            top += 1
            # what was carried over is a mere bound: look there first
            ends[top, 0] = 0.5 * (t + until) if exact else t
            is_new = True
            continue
        t, exact = until, True
        low = low_true = gap - TOL_MM
        if inside:
            deepest = min(deepest, gap)
            events[current, DEPTH] = -deepest
            inside = gap <= CLOSE_MM
        elif gap < OPEN_MM and rows < events.shape[0]:
            bare = _uncovered(values, voxel, grid, before, after, t, head, event)
            if bare < OPEN_MM:
                inside, deepest, current = True, bare, rows
                event[TIME], event[GAP], event[DEPTH] = t, bare, -bare
                events[rows] = event
                rows += 1
        top -= 1
        is_new = False
        if top < 0:
            if t >= 1.0:
                break
            top, is_new = 0, True
            ends[0, 0] = 1.0
    state[LOW], state[LOW_TRUE] = low, low_true
    state[INSIDE], state[DEEPEST] = 1.0 if inside else 0.0, deepest
    return rows


@njit(cache=True, nogil=True, error_model="numpy")
def reach_of_cut(
    values: Shorts, voxel: Doubles, grid: tuple[float, float, float],
    head: tuple[Floats, Bytes, Floats, Doubles], distance: Floats, rows: Doubles,
    low: Doubles, high: Doubles, place: Doubles,
) -> float:  # fmt: skip
    """Return the least hazard distance of what a cut laid open, mm; +inf for none.

    By halving a box from `low` to `high`, patient mm, where it can hold something
    nearer. distance: as it is after the cut. rows: its solids. place: gets where.
    """
    pristine, wall, thickness, head_voxel = head
    best = math.inf
    stack = np.empty((256, 6))
    stack[0, :3] = 0.5 * (low + high)
    stack[0, 3:] = 0.5 * (high - low)
    top = 1
    while top > 0:
        top -= 1
        x, y, z = stack[top, 0], stack[top, 1], stack[top, 2]
        a, b, c = stack[top, 3], stack[top, 4], stack[top, 5]
        reach = math.sqrt(a * a + b * b + c * c)
        here = hazard_mm(values, voxel, grid[0], x, y, z)
        if max(here - grid[1] * reach, grid[2]) >= min(best - TOL_MM, OPEN_MM):
            continue
        solid = solids_distance(x, y, z, rows)
        if solid > reach + ROUGHEST_MM:
            continue
        air = depth_mm(distance, head_voxel, x, y, z)
        if air > STEEPEST * reach:
            continue
        if solid <= 0.0 and air <= 0.0 and here < min(best, OPEN_MM):
            depth = _depth_in_wall(pristine, head_voxel, x, y, z)
            plate = plate_mm(wall, thickness, head_voxel, x, y, z)
            if depth > 0.0 and (
                depth >= plate - COVER_MM or _is_middle(pristine, head_voxel, x, y, z)
            ):
                best = here
                place[0], place[1], place[2] = x, y, z
        if reach < LEAST_BOX_MM:
            continue
        for half in (-0.5, 0.5):
            stack[top] = (x, y, z, a, b, c)
            longest = 0 if a >= max(b, c) else (1 if b >= c else 2)
            stack[top, longest] += half * stack[top, 3 + longest]
            stack[top, 3 + longest] *= 0.5
            top += 1
    return best


@njit(cache=True, nogil=True, error_model="numpy")
def _is_middle(pristine: Floats, voxel: Doubles, x: float, y: float, z: float) -> bool:
    """Return whether a place is as far from the air on one side as on the other."""
    h = ALONG_MM
    a = depth_mm(pristine, voxel, x + h, y, z) - depth_mm(pristine, voxel, x - h, y, z)
    b = depth_mm(pristine, voxel, x, y + h, z) - depth_mm(pristine, voxel, x, y - h, z)
    c = depth_mm(pristine, voxel, x, y, z + h) - depth_mm(pristine, voxel, x, y, z - h)
    return a * a + b * b + c * c < (1.2 * h) ** 2
