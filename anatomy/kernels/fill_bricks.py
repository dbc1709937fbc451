"""Filling of a lattice in groups of bricks, without what cannot reach them.

A voxel has the same bits in any brick, on any thread, in any field of view: programs
treat each point alone, lattice coordinates are ``index * spacing`` with one global
index, and only values that would be clamped are left out.
"""

import math
from typing import cast

import numpy as np
from numba import njit

from anatomy.kernels.displace import displace
from anatomy.kernels.evaluate_blocks import FAR, PART_ROWS, evaluate_block
from anatomy.kernels.paint_ground import CLEAR, THICKEST
from anatomy.kernels.stack_program import run_program, side_points
from anatomy.kernels.tables import (
    POINT_ROWS,
    Bools,
    Floats,
    Grids,
    Longs,
    Sampling,
    Scratch,
    Tables,
)

F0, F1 = np.float32(0), np.float32(1)
I0, I1 = cast(int, np.int64(0)), cast(int, np.int64(1))
"""A literal would compile all that takes it once more."""

GROUP = 4
"""Bricks along the edge of a group."""


@njit(cache=True, nogil=True, error_model="numpy")
def _in_reach(
    p: Floats,
    radius: np.float32,
    band: np.float32,
    sharp: np.float32,
    t: Tables,
    work: Floats,
    marks: Floats,
    active: Bools,
    seen: Bools,
) -> int:
    """Keep, of parts and solids, those whose values matter within `radius` of a point.

    Gives the number of parts. Marks of parts are unknown here, so solids that read
    them always count.
    """
    side_p, noise, stack = work[0:4], work[4:6], work[POINT_ROWS:]
    noise[:, 0] = F0
    count = 0
    for k in range(t.parts.shape[0]):
        if not active[k]:
            continue
        side_points(p, I1, np.float32(t.parts[k, 2]), t.septum, side_p)
        begin, end = t.parts[k, 0], t.parts[k, 1]
        run_program(
            t.code, t.constants, begin, end, side_p, noise, I1, I1, stack, marks
        )
        least = stack[0, 0] - t.reach[k, 0] * radius - t.reach[k, 1]
        active[k] = least <= band
        count += active[k]
    marks[:, 0] = FAR
    side_points(p, I1, F0, t.septum, side_p)
    run_program(
        t.code,
        t.constants,
        t.common[0],
        t.common[1],
        side_p,
        noise,
        I1,
        I1,
        stack,
        marks,
    )
    for q in range(t.solids.shape[0]):
        if not seen[q]:
            continue
        row = int(t.solids[q, 0])
        if row >= 0:
            least = marks[row, 0] if row >= PART_ROWS else -FAR
        else:
            begin, end = t.ground[q, 0], t.ground[q, 1]
            run_program(
                t.code, t.constants, begin, end, side_p, noise, I1, I1, stack, marks
            )
            least = stack[0, 0]
        level, half = t.solids[q, 4], t.solids[q, 1]
        slack = t.solids[q, 5] * radius + THICKEST * half + (CLEAR + F1) / sharp
        seen[q] = least - level <= slack
        if half > F0 and row < PART_ROWS and row >= 0:
            continue
        if half > F0:
            seen[q] = abs(least - level) <= slack
    return count


@njit(cache=True, nogil=True, error_model="numpy")
def _middle(
    origin: Longs,
    spacing: float,
    spread: Floats,
    low: Longs,
    high: Longs,
    p: Floats,
) -> np.float32:
    """Put the middle of voxels `low` to before `high` into p; give their radius."""
    square = 0.0
    for axis in range(3):
        across = high[axis] - 1 - low[axis]
        middle = 0.5 * (low[axis] + high[axis] - 1)
        sign = 1.0 if axis == 2 else -1.0
        p[axis, 0] = (origin[axis] + sign * middle) * spacing
        square += float(across * across)
    displace(p, I1, spread)
    return np.float32(0.5 * spacing * math.sqrt(square))


@njit(cache=True, nogil=True, error_model="numpy")
def _fill_brick(
    low: Longs,
    high: Longs,
    at: Sampling,
    t: Tables,
    scratch: Scratch,
    g: Grids,
) -> None:
    """Evaluate voxels `low` to before `high`, both x, y, z, into the grids."""
    origin, spacing, flat = at.origin, at.spacing, scratch.flat
    p = scratch.work[6:9]
    n = I0
    for z in range(low[2], high[2]):
        for y in range(low[1], high[1]):
            for x in range(low[0], high[0]):
                p[0, n] = (origin[0] - x) * spacing
                p[1, n] = (origin[1] - y) * spacing
                p[2, n] = (origin[2] + z) * spacing
                n += 1
    displace(p, n, t.spread)
    layer = (high[0] - low[0]) * (high[1] - low[1])
    if t.spread.shape[0] > 0:
        # what has moved lies in no layers any more
        layer = n
    evaluate_block(
        p,
        n,
        layer,
        scratch.parts[1],
        scratch.solids[1],
        at.band,
        at.sharp,
        t,
        scratch.work,
        scratch.fresh,
        scratch.kept,
        flat,
    )
    i = 0
    for z in range(low[2], high[2]):
        for y in range(low[1], high[1]):
            for x in range(low[0], high[0]):
                g.air[z, y, x], g.gap[z, y, x] = flat.air[i], flat.gap[i]
                g.part[z, y, x] = flat.part[i]
                g.structure[z, y, x] = flat.structure[i]
                g.blood[z, y, x], g.skin[z, y, x] = flat.blood[i], flat.skin[i]
                g.ground_hu[z, y, x] = flat.ground_hu[i]
                g.ground[z, y, x] = flat.ground[i]
                g.plate[z, y, x] = flat.plate[i]
                g.density[z, y, x] = flat.density[i]
                i += 1


@njit(cache=True, nogil=True, error_model="numpy")
def fill_groups(
    first: int,
    last: int,
    edge: int,
    skipping: bool,
    at: Sampling,
    t: Tables,
    scratch: Scratch,
    g: Grids,
    counters: Longs,
) -> None:
    """Evaluate groups `first` to `last` of ``GROUP^3`` bricks into the grids.

    A part whose value at the middle, less what it can change on the way to a corner,
    exceeds `band` is left out: its values would all be clamped. What cannot reach the
    group is not tried on its bricks.

    counters: bricks seen, bricks with a part in reach, part evaluations, parts seen.
    """
    origin, spacing, band, sharp = at.origin, at.spacing, at.band, at.sharp
    work, fresh = scratch.work, scratch.fresh
    choice, seen = scratch.parts, scratch.solids
    size = np.array(g.air.shape)[::-1]
    groups = (size + GROUP * edge - 1) // (GROUP * edge)
    low, high = np.empty(3, np.int64), np.empty(3, np.int64)
    begin, end = np.empty(3, np.int64), np.empty(3, np.int64)
    p = work[6:9]
    for group in range(first, last):
        rest = group
        for axis in range(3):
            begin[axis] = rest % groups[axis] * GROUP * edge
            end[axis] = min(begin[axis] + GROUP * edge, size[axis])
            rest //= groups[axis]
        choice[0], seen[0] = True, True
        if skipping:
            radius = _middle(origin, spacing, t.spread, begin, end, p)
            _in_reach(p, radius, band, sharp, t, work, fresh, choice[0], seen[0])
        for z in range(begin[2], end[2], edge):
            for y in range(begin[1], end[1], edge):
                for x in range(begin[0], end[0], edge):
                    low[0], low[1], low[2] = x, y, z
                    for axis in range(3):
                        high[axis] = min(low[axis] + edge, end[axis])
                    choice[1], seen[1] = choice[0], seen[0]
                    active, solid = choice[1], seen[1]
                    count = t.parts.shape[0]
                    if skipping:
                        radius = _middle(origin, spacing, t.spread, low, high, p)
                        count = _in_reach(
                            p, radius, band, sharp, t, work, fresh, active, solid
                        )
                    counters[0] += 1
                    counters[1] += count > 0
                    counters[2] += count
                    counters[3] += t.parts.shape[0]
                    _fill_brick(low, high, at, t, scratch, g)
