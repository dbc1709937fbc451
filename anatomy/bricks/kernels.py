"""Compiled evaluation of one head over bricks of a lattice or over points.

A point's value has the same bits in any brick, on any thread, in any field of view:
the programs treat each point alone, and lattice coordinates are ``index * spacing``
with one global index.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numba import njit

from anatomy.kernels import noise_rows, run_program, side_points

F0, F1, HALF = np.float32(0), np.float32(1), np.float32(0.5)
FAR = np.float32(99)

SOLID_ROWS, PHARYNX_ROW, OUTSIDE_ROW, SKIN_ROW = 5, 5, 6, 9
"""Rows of marks with a meaning here: the first five are solids inside the cavity, the
pharynx and the outside are air shared by both sides, skin is where the nose is dry."""
PART_ROWS = 8
"""Rows that the parts mark; the later ones belong to the common fields."""
NASAL = 1
"""The nasal cavities' number, less 10 times the side."""
SHARED_MM = np.float32(1.5)
"""Blending and unevenness part the nose's surface from the pharynx's by up to this."""


class Tables(NamedTuple):
    """Bundle the arrays that describe one head (`anatomy.model` fills them).

    code ``(n, 4)`` int32, constants ``(m,)``: the stack programs.
    parts ``(P, 4)`` int32: first instruction, end, side, cavity (0: never opposite).
    reach ``(P, 2)``: Lipschitz constant and noise bound of each part.
    common ``(2,)`` int32: span of the field that only leaves marks.
    septum ``(5,)``: deviation, centre y, 1 / extent y, centre z, 1 / extent z.
    octaves ``(k, 16)``, limits ``(2,)``, perm ``(256,)``, grad ``(256, 3)``: noise.
    tint ``(r, 4)``: mark row, centre mm, half width mm, blood fraction.
    solids ``(q, 5)``: mark row, half thickness mm (0: solid), HU, label, sheet level.
    """

    code: Any
    constants: Any
    parts: Any
    reach: Any
    common: Any
    septum: Any
    octaves: Any
    limits: Any
    perm: Any
    grad: Any
    tint: Any
    solids: Any


class Grids(NamedTuple):
    """Bundle the output arrays, each ``(nz, ny, nx)``.

    air: least part value, clamped to the band, float32 mm; gap: least value of a part
    of another cavity, float32 mm; part: index of the least part, 255 where none is in
    the band; structure: row of the solid's mark at this place, 255 for none; blood:
    blood fraction, square root scale; skin: skin weight; ground_hu int16 and ground:
    HU and label of what lies behind mucosa and bone shell.
    """

    air: Any
    gap: Any
    part: Any
    structure: Any
    blood: Any
    skin: Any
    ground_hu: Any
    ground: Any


@njit(cache=True, nogil=True, error_model="numpy")
def evaluate_points(points: Any, t: Tables, work: Any, marks: Any, value: Any) -> None:
    """Give the least part value at ``(3, n)`` RAS points, unclamped.

    work: ``(8 + depth, n)`` scratch; marks: ``(rows, n)`` scratch.
    """
    n = points.shape[1]
    side_p, noise, stack = work[0:3], work[3:5], work[8:]
    noise_rows(points, n, t.octaves, t.limits, t.perm, t.grad, noise)
    value[:n] = np.float32(1e9)
    for k in range(t.parts.shape[0]):
        side_points(points, n, np.float32(t.parts[k, 2]), t.septum, side_p)
        begin, end = t.parts[k, 0], t.parts[k, 1]
        run_program(t.code, t.constants, begin, end, side_p, noise, n, stack, marks)
        for i in range(n):
            value[i] = min(value[i], stack[0, i])


@njit(cache=True, nogil=True, error_model="numpy")
def _smoothstep(x: Any) -> Any:
    x = min(max(x, F0), F1)
    return x * x * (np.float32(3) - np.float32(2) * x)


@njit(cache=True, nogil=True, error_model="numpy")
def _normal_cdf(x: Any) -> Any:
    return np.float32(0.5 * math.erfc(-x * 0.7071067811865476))


@njit(cache=True, nogil=True, error_model="numpy")
def _describe(t: Tables, m: Any, i: int, inside: bool, sharp: Any) -> Any:
    """Turn the marks of point `i` into blood, skin, ground HU and ground label."""
    blood = np.float32(0.11)
    if inside:
        for r in range(t.tint.shape[0]):
            d = (m[int(t.tint[r, 0]), i] - t.tint[r, 1]) / t.tint[r, 2]
            blood += (F1 - _smoothstep(HALF + HALF * d)) * (t.tint[r, 3] - blood)
    hu, label, best = np.float32(0), 0, F0
    for q in range(t.solids.shape[0]):
        d = (m[int(t.solids[q, 0]), i] - t.solids[q, 4]) * sharp
        half = t.solids[q, 1] * sharp
        if half > F0:
            d = abs(d)
        if d > np.float32(4) + half:
            continue
        if half > F0:
            w = _normal_cdf(half - d) - _normal_cdf(-half - d)
        else:
            w = _normal_cdf(-d)
        hu += w * (t.solids[q, 2] - hu)
        best *= F1 - w
        if w >= best:
            best, label = w, int(t.solids[q, 3])
    return blood, hu, label


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
    flags: Any,
    g: Grids,
    counters: Any,
) -> None:
    """Evaluate bricks `first` to `last` of the lattice into the grids.

    A part whose value at the brick's centre, less what it can change on the way to a
    corner, exceeds `band` is left out: its values would all be clamped.

    sharp: 1 / (standard deviation of the voxel's blur in mm), for the ground's edges.
    origin: ``(3,)`` int64 global lattice index of voxel 0, RAS order x, y, z; the
    arrays run along -x and -y (their world is LPS). work, fresh, kept, flags: scratch.
    counters: bricks seen, bricks with a part in reach, part evaluations, parts seen.
    """
    nz, ny, nx = g.air.shape
    by, bx = (ny + edge - 1) // edge, (nx + edge - 1) // edge
    side_p, noise, p, stack = work[0:3], work[3:5], work[5:8], work[8:]
    count = t.parts.shape[0]
    for brick in range(first, last):
        z0, y0, x0 = brick // (by * bx), brick // bx % by, brick % bx
        z0, y0, x0 = z0 * edge, y0 * edge, x0 * edge
        z1, y1, x1 = min(z0 + edge, nz), min(y0 + edge, ny), min(x0 + edge, nx)
        dx, dy, dz = x1 - x0 - 1, y1 - y0 - 1, z1 - z0 - 1
        radius = 0.5 * spacing * math.sqrt(dx * dx + dy * dy + dz * dz)
        p[0, 0] = (origin[0] - 0.5 * (x0 + x1 - 1)) * spacing
        p[1, 0] = (origin[1] - 0.5 * (y0 + y1 - 1)) * spacing
        p[2, 0] = (origin[2] + 0.5 * (z0 + z1 - 1)) * spacing
        noise[:, 0] = F0
        active = 0
        for k in range(count):
            flags[k] = True
            if skipping:
                side_points(p, 1, np.float32(t.parts[k, 2]), t.septum, side_p)
                begin, end = t.parts[k, 0], t.parts[k, 1]
                run_program(
                    t.code, t.constants, begin, end, side_p, noise, 1, stack, fresh
                )
                least = stack[0, 0] - t.reach[k, 0] * radius - t.reach[k, 1]
                flags[k] = least <= band
            active += flags[k]
        counters[0] += 1
        counters[1] += active > 0
        counters[2] += active
        counters[3] += count
        n = 0
        for z in range(z0, z1):
            for y in range(y0, y1):
                for x in range(x0, x1):
                    p[0, n] = (origin[0] - x) * spacing
                    p[1, n] = (origin[1] - y) * spacing
                    p[2, n] = (origin[2] + z) * spacing
                    g.air[z, y, x], g.gap[z, y, x], g.part[z, y, x] = band, band, 255
                    n += 1
        if active:
            noise_rows(p, n, t.octaves, t.limits, t.perm, t.grad, noise)
        kept[:, :n] = FAR
        for k in range(count):
            if not flags[k]:
                continue
            side_points(p, n, np.float32(t.parts[k, 2]), t.septum, side_p)
            fresh[:PART_ROWS, :n] = FAR
            begin, end = t.parts[k, 0], t.parts[k, 1]
            run_program(t.code, t.constants, begin, end, side_p, noise, n, stack, fresh)
            for r in range(PART_ROWS):
                for i in range(n):
                    # Marks count only where their part does, so that leaving the
                    # part out elsewhere changes nothing.
                    if stack[0, i] < band:
                        kept[r, i] = min(kept[r, i], fresh[r, i])
            i = 0
            for z in range(z0, z1):
                for y in range(y0, y1):
                    for x in range(x0, x1):
                        v = stack[0, i]
                        i += 1
                        old = g.part[z, y, x]
                        cavity = t.parts[k, 3]
                        other = old != 255 and t.parts[old, 3] != cavity
                        if v < g.air[z, y, x]:
                            if cavity == 0:
                                g.gap[z, y, x] = band
                            elif other:
                                g.gap[z, y, x] = g.air[z, y, x]
                            g.air[z, y, x], g.part[z, y, x] = v, k
                        elif v < g.gap[z, y, x] and cavity != 0 and other:
                            g.gap[z, y, x] = v
        near = False
        for z in range(z0, z1):
            for y in range(y0, y1):
                for x in range(x0, x1):
                    near = near or g.air[z, y, x] >= -band
        if near:
            side_points(p, n, F0, t.septum, side_p)
            begin, end = t.common[0], t.common[1]
            run_program(t.code, t.constants, begin, end, side_p, noise, n, stack, kept)
        i = 0
        for z in range(z0, z1):
            for y in range(y0, y1):
                for x in range(x0, x1):
                    a = g.air[z, y, x]
                    inside = a < band
                    shared = min(kept[PHARYNX_ROW, i], kept[OUTSIDE_ROW, i])
                    if shared < a + band:
                        g.gap[z, y, x] = band
                    structure, least = 255, np.float32(0.4)
                    for r in range(SOLID_ROWS):
                        if kept[r, i] < least:
                            structure, least = r, kept[r, i]
                    nasal = inside and t.parts[g.part[z, y, x], 3] % 10 == NASAL
                    if structure == 255 and nasal and shared <= a + SHARED_MM:
                        pharynx = kept[PHARYNX_ROW, i] <= shared
                        structure = PHARYNX_ROW if pharynx else OUTSIDE_ROW
                    g.structure[z, y, x] = structure
                    i += 1
                    if a < -band:
                        # No surface near: nothing that follows is ever looked at.
                        g.blood[z, y, x], g.skin[z, y, x] = 0, 0
                        g.ground_hu[z, y, x], g.ground[z, y, x] = -1000, 0
                        continue
                    blood, hu, label = _describe(t, kept, i - 1, inside, sharp)
                    g.blood[z, y, x] = np.uint8(np.float32(255) * np.sqrt(blood) + HALF)
                    skin = F1 - _smoothstep(HALF + HALF * kept[SKIN_ROW, i - 1])
                    g.skin[z, y, x] = np.uint8(np.float32(255) * skin + HALF)
                    g.ground_hu[z, y, x] = np.int16(round(hu))
                    g.ground[z, y, x] = label
