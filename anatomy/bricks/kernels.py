"""Compiled evaluation of one head over bricks of a lattice or over points.

A point's value has the same bits in any brick, on any thread, in any field of view:
the programs treat each point alone, and lattice coordinates are ``index * spacing``
with one global index.
"""

import math
from typing import Any

import numpy as np
from numba import njit

from anatomy.bricks.tables import Grids, Tables
from anatomy.ground.kernels import CLEAR, paint_ground
from anatomy.kernels import noise_rows, run_program, side_points

F0, F1, HALF = np.float32(0), np.float32(1), np.float32(0.5)
FAR = np.float32(99)

SOLID_ROWS, PHARYNX_ROW, OUTSIDE_ROW, SKIN_ROW = 6, 6, 7, 10
"""Rows of marks with a meaning here: the first six are solids inside the cavity, the
pharynx and the outside are air shared by both sides, skin is where the nose is dry."""
PART_ROWS = 9
"""Rows that the parts mark; the later ones belong to the common fields."""
NASAL = 1
"""The nasal cavities' number, less 10 times the side."""
SHARED_MM = np.float32(1.5)
"""Blending and unevenness part the nose's surface from the pharynx's by up to this."""
POINT_ROWS = 12
"""Rows of scratch before the stack: side's point 4, noise 2, point 3, ground 3."""


@njit(cache=True, nogil=True, error_model="numpy")
def evaluate_points(points: Any, t: Tables, work: Any, marks: Any, value: Any) -> None:
    """Give the least part value at ``(3, n)`` RAS points, unclamped.

    work: ``(POINT_ROWS + depth, n)`` scratch; marks: ``(rows, n)`` scratch.
    """
    n = points.shape[1]
    side_p, noise, stack = work[0:4], work[4:6], work[POINT_ROWS:]
    noise_rows(points, n, t.octaves, t.limits, t.perm, t.grad, noise)
    value[:n] = np.float32(1e9)
    for k in range(t.parts.shape[0]):
        side_points(points, n, np.float32(t.parts[k, 2]), t.septum, side_p)
        begin, end = t.parts[k, 0], t.parts[k, 1]
        run_program(t.code, t.constants, begin, end, side_p, noise, n, stack, marks)
        for i in range(n):
            value[i] = min(value[i], stack[0, i])


@njit(cache=True, nogil=True, error_model="numpy")
def evaluate_span(
    points: Any,
    t: Tables,
    side: Any,
    begin: int,
    end: int,
    work: Any,
    marks: Any,
    out: Any,
) -> None:
    """Evaluate one field without unevenness at ``(3, n)`` RAS points, of one side."""
    n = points.shape[1]
    side_p, noise, stack = work[0:4], work[4:6], work[POINT_ROWS:]
    noise[:, :n] = F0
    side_points(points, n, side, t.septum, side_p)
    run_program(t.code, t.constants, begin, end, side_p, noise, n, stack, marks)
    out[:n] = stack[0, :n]


@njit(cache=True, nogil=True, error_model="numpy")
def _smoothstep(x: Any) -> Any:
    x = min(max(x, F0), F1)
    return x * x * (np.float32(3) - np.float32(2) * x)


@njit(cache=True, nogil=True, error_model="numpy")
def evaluate_block(
    p: Any,
    n: int,
    active: Any,
    seen: Any,
    band: Any,
    sharp: Any,
    t: Tables,
    work: Any,
    fresh: Any,
    kept: Any,
    o: Grids,
) -> None:
    """Evaluate everything at `n` points ``p[:, :n]`` into the flat arrays of `o`.

    active, seen: which parts and which solids may reach the block. The same point
    gets the same bits whatever the others are and whatever was rightly left out.
    """
    side_p, noise, stack = work[0:4], work[4:6], work[POINT_ROWS:]
    o.air[:n], o.gap[:n], o.part[:n] = band, band, 255
    kept[:, :n] = FAR
    noisy = False
    for k in range(t.parts.shape[0]):
        noisy = noisy or (active[k] and t.reach[k, 1] > F0)
    noise[:, :n] = F0
    if noisy:
        noise_rows(p, n, t.octaves, t.limits, t.perm, t.grad, noise)
    for k in range(t.parts.shape[0]):
        if not active[k]:
            continue
        side_points(p, n, np.float32(t.parts[k, 2]), t.septum, side_p)
        fresh[:PART_ROWS, :n] = FAR
        begin, end = t.parts[k, 0], t.parts[k, 1]
        run_program(t.code, t.constants, begin, end, side_p, noise, n, stack, fresh)
        cavity = t.parts[k, 3]
        for r in range(PART_ROWS):
            for i in range(n):
                # Marks count only where their part does, so that leaving the part
                # out elsewhere changes nothing.
                if stack[0, i] < band:
                    kept[r, i] = min(kept[r, i], fresh[r, i])
        for i in range(n):
            v, old = stack[0, i], o.part[i]
            other = old != 255 and t.parts[old, 3] != cavity
            if v < o.air[i]:
                if cavity == 0:
                    o.gap[i] = band
                elif other:
                    o.gap[i] = o.air[i]
                o.air[i], o.part[i] = v, k
            elif v < o.gap[i] and cavity != 0 and other:
                o.gap[i] = v
    near = False
    for i in range(n):
        near = near or o.air[i] >= -band
    hu, clear, most = work[9], work[10], work[11]
    if near:
        side_points(p, n, F0, t.septum, side_p)
        begin, end = t.common[0], t.common[1]
        run_program(t.code, t.constants, begin, end, side_p, noise, n, stack, kept)
        paint_ground(
            n, t, seen, sharp, side_p, noise, stack, kept, clear, hu, most, o.ground
        )
    for i in range(n):
        a = o.air[i]
        inside = a < band
        shared = min(kept[PHARYNX_ROW, i], kept[OUTSIDE_ROW, i])
        if shared < a + band:
            o.gap[i] = band
        structure, least = 255, np.float32(0.4)
        for r in range(SOLID_ROWS):
            if kept[r, i] < least:
                structure, least = r, kept[r, i]
        nasal = inside and t.parts[o.part[i], 3] % 10 == NASAL
        if structure == 255 and nasal and shared <= a + SHARED_MM:
            pharynx = kept[PHARYNX_ROW, i] <= shared
            structure = PHARYNX_ROW if pharynx else OUTSIDE_ROW
        o.structure[i] = structure
        if a < -band:
            # No surface near: nothing that follows is ever looked at.
            o.blood[i], o.skin[i], o.ground_hu[i], o.ground[i] = 0, 0, -1000, 0
            continue
        blood = np.float32(0.11)
        if inside:
            for r in range(t.tint.shape[0]):
                d = (kept[int(t.tint[r, 0]), i] - t.tint[r, 1]) / t.tint[r, 2]
                faded = F1 - _smoothstep(HALF + HALF * d)
                blood += faded * (t.tint[r, 3] - blood)
        o.blood[i] = np.uint8(np.float32(255) * np.sqrt(blood) + HALF)
        skin = F1 - _smoothstep(HALF + HALF * kept[SKIN_ROW, i])
        o.skin[i] = np.uint8(np.float32(255) * skin + HALF)
        o.ground_hu[i] = np.int16(round(hu[i]))


@njit(cache=True, nogil=True, error_model="numpy")
def _in_reach(
    p: Any,
    radius: Any,
    skipping: bool,
    band: Any,
    sharp: Any,
    t: Tables,
    work: Any,
    marks: Any,
    active: Any,
    seen: Any,
) -> int:
    """Find the parts and solids whose values matter within `radius` of a point.

    Marks of parts are unknown here, so solids that read them always count.
    """
    side_p, noise, stack = work[0:4], work[4:6], work[POINT_ROWS:]
    noise[:, 0] = F0
    count = 0
    for k in range(t.parts.shape[0]):
        active[k] = True
        if skipping:
            side_points(p, 1, np.float32(t.parts[k, 2]), t.septum, side_p)
            begin, end = t.parts[k, 0], t.parts[k, 1]
            run_program(t.code, t.constants, begin, end, side_p, noise, 1, stack, marks)
            least = stack[0, 0] - t.reach[k, 0] * radius - t.reach[k, 1]
            active[k] = least <= band
        count += active[k]
    seen[:] = True
    if not skipping:
        return count
    marks[:, 0] = FAR
    side_points(p, 1, F0, t.septum, side_p)
    run_program(
        t.code,
        t.constants,
        t.common[0],
        t.common[1],
        side_p,
        noise,
        1,
        stack,
        marks,
    )
    for q in range(t.solids.shape[0]):
        row = int(t.solids[q, 0])
        if row >= 0:
            least = marks[row, 0] if row >= PART_ROWS else -FAR
        else:
            begin, end = t.ground[q, 0], t.ground[q, 1]
            run_program(t.code, t.constants, begin, end, side_p, noise, 1, stack, marks)
            least = stack[0, 0]
        level, half = t.solids[q, 4], t.solids[q, 1]
        slack = t.solids[q, 5] * radius + half + (CLEAR + F1) / sharp
        seen[q] = least - level <= slack
        if half > F0 and row < PART_ROWS and row >= 0:
            continue
        if half > F0:
            seen[q] = abs(least - level) <= slack
    return count


@njit(cache=True, nogil=True, error_model="numpy")
def fill_bricks(
    first: int,
    last: int,
    edge: int,
    skipping: bool,
    origin: Any,
    spacing: float,
    band: Any,
    sharp: Any,
    t: Tables,
    work: Any,
    fresh: Any,
    kept: Any,
    active: Any,
    seen: Any,
    flat: Grids,
    g: Grids,
    counters: Any,
) -> None:
    """Evaluate bricks `first` to `last` of the lattice into the grids.

    A part whose value at the brick's centre, less what it can change on the way to a
    corner, exceeds `band` is left out: its values would all be clamped.

    sharp: 1 / (standard deviation of the voxel's blur in mm), for the ground's edges.
    origin: ``(3,)`` int64 global lattice index of voxel 0, RAS order x, y, z; the
    arrays run along -x and -y (their world is LPS). The arrays between `t` and `g`
    are scratch. counters: bricks seen, bricks with a part in reach, part
    evaluations, parts seen.
    """
    nz, ny, nx = g.air.shape
    by, bx = (ny + edge - 1) // edge, (nx + edge - 1) // edge
    p = work[6:9]
    for brick in range(first, last):
        z0, y0, x0 = brick // (by * bx), brick // bx % by, brick % bx
        z0, y0, x0 = z0 * edge, y0 * edge, x0 * edge
        z1, y1, x1 = min(z0 + edge, nz), min(y0 + edge, ny), min(x0 + edge, nx)
        dx, dy, dz = x1 - x0 - 1, y1 - y0 - 1, z1 - z0 - 1
        radius = np.float32(0.5 * spacing * math.sqrt(dx * dx + dy * dy + dz * dz))
        p[0, 0] = (origin[0] - 0.5 * (x0 + x1 - 1)) * spacing
        p[1, 0] = (origin[1] - 0.5 * (y0 + y1 - 1)) * spacing
        p[2, 0] = (origin[2] + 0.5 * (z0 + z1 - 1)) * spacing
        count = _in_reach(
            p, radius, skipping, band, sharp, t, work, fresh, active, seen
        )
        counters[0] += 1
        counters[1] += count > 0
        counters[2] += count
        counters[3] += t.parts.shape[0]
        n = 0
        for z in range(z0, z1):
            for y in range(y0, y1):
                for x in range(x0, x1):
                    p[0, n] = (origin[0] - x) * spacing
                    p[1, n] = (origin[1] - y) * spacing
                    p[2, n] = (origin[2] + z) * spacing
                    n += 1
        evaluate_block(p, n, active, seen, band, sharp, t, work, fresh, kept, flat)
        i = 0
        for z in range(z0, z1):
            for y in range(y0, y1):
                for x in range(x0, x1):
                    g.air[z, y, x], g.gap[z, y, x] = flat.air[i], flat.gap[i]
                    g.part[z, y, x] = flat.part[i]
                    g.structure[z, y, x] = flat.structure[i]
                    g.blood[z, y, x], g.skin[z, y, x] = flat.blood[i], flat.skin[i]
                    g.ground_hu[z, y, x] = flat.ground_hu[i]
                    g.ground[z, y, x] = flat.ground[i]
                    i += 1
