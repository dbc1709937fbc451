"""Evaluation of one head at the points of a block.

A point's value has the same bits in any brick, on any thread, in any field of view:
the programs treat each point alone, and lattice coordinates are ``index * spacing``
with one global index.
"""

import numpy as np
from numba import njit

from anatomy.kernels.paint_ground import paint_ground
from anatomy.kernels.stack_program import (
    grain_at,
    noise_rows,
    run_program,
    side_points,
)
from anatomy.kernels.tables import (
    MEAN_DENSITY,
    POINT_ROWS,
    Bools,
    Floats,
    Grids,
    Tables,
)

F0, F1, HALF = np.float32(0), np.float32(1), np.float32(0.5)
FAR = np.float32(99)

SOLID_ROWS, PHARYNX_ROW, OUTSIDE_ROW, SKIN_ROW = 6, 6, 7, 11
"""Rows of marks with a meaning here: the first six are solids inside the cavity, the
pharynx and the outside are air shared by both sides, skin is where the nose is dry."""
PART_ROWS = 10
"""Rows that the parts mark; the later ones belong to the common fields."""
NASAL = 1
"""The nasal cavities' number, less 10 times the side."""
UNEVEN_DENSITY, LEAST_DENSITY, MOST_DENSITY = (
    np.float32(0.33),
    np.float32(0.05),
    np.float32(1.9),
)
"""Standard deviation and bounds of thin bone's density about 1: the least is a gap."""
SHELL_MM = np.float32(1.0)
"""Deeper in the air no bone is seen."""
SHARED_MM = np.float32(1.5)
"""Blending and unevenness part the nose's surface from the pharynx's by up to this."""


@njit(cache=True, nogil=True, error_model="numpy")
def evaluate_points(
    points: Floats, t: Tables, work: Floats, marks: Floats, value: Floats
) -> None:
    """Write the least part value at ``(3, n)`` RAS points, unclamped, to `value`.

    work: ``(POINT_ROWS + depth, n)`` scratch; marks: ``(rows, n)`` scratch.
    """
    n = points.shape[1]
    side_p, noise, stack = work[0:4], work[4:6], work[POINT_ROWS:]
    noise_rows(points, n, t.octaves, t.limits, t.perm, t.grad, noise)
    value[:n] = np.float32(1e9)
    for k in range(t.parts.shape[0]):
        side_points(points, n, np.float32(t.parts[k, 2]), t.septum, side_p)
        begin, end = t.parts[k, 0], t.parts[k, 1]
        run_program(t.code, t.constants, begin, end, side_p, noise, n, n, stack, marks)
        for i in range(n):
            value[i] = min(value[i], stack[0, i])


@njit(cache=True, nogil=True, error_model="numpy")
def evaluate_span(
    points: Floats,
    t: Tables,
    side: np.float32,
    begin: int,
    end: int,
    work: Floats,
    marks: Floats,
    out: Floats,
) -> None:
    """Evaluate one field without unevenness at ``(3, n)`` RAS points, of one side."""
    n = points.shape[1]
    side_p, noise, stack = work[0:4], work[4:6], work[POINT_ROWS:]
    noise[:, :n] = F0
    side_points(points, n, side, t.septum, side_p)
    run_program(t.code, t.constants, begin, end, side_p, noise, n, n, stack, marks)
    out[:n] = stack[0, :n]


@njit(cache=True, nogil=True, error_model="numpy")
def _smoothstep(x: np.float32) -> np.float32:
    x = min(max(x, F0), F1)
    return x * x * (np.float32(3) - np.float32(2) * x)


@njit(cache=True, nogil=True, error_model="numpy")
def evaluate_block(
    p: Floats,
    n: int,
    layer: int,
    active: Bools,
    seen: Bools,
    band: np.float32,
    sharp: np.float32,
    t: Tables,
    work: Floats,
    fresh: Floats,
    kept: Floats,
    o: Grids,
) -> None:
    """Evaluate everything at `n` points ``p[:, :n]`` into the flat arrays of `o`.

    layer: see `run_program`. active, seen: which parts and which solids may reach the
    block. The same point
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
        run_program(
            t.code, t.constants, begin, end, side_p, noise, n, layer, stack, fresh
        )
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
    o.plate[:n] = 255
    for i in range(n):
        near = near or o.air[i] >= -band
    hu = work[9]
    if near:
        side_points(p, n, F0, t.septum, side_p)
        begin, end = t.common[0], t.common[1]
        run_program(
            t.code, t.constants, begin, end, side_p, noise, n, layer, stack, kept
        )
        for q in range(t.plates.shape[0]):
            begin, end = t.plates[q, 0], t.plates[q, 1]
            run_program(
                t.code, t.constants, begin, end, side_p, noise, n, layer, stack, kept
            )
            for i in range(n):
                if stack[0, i] < F0:
                    o.plate[i] = np.uint8(q)
        paint_ground(p, n, layer, t, seen, sharp, work, kept, o.ground)
    for i in range(n):
        a = o.air[i]
        inside = a < band
        shared = min(kept[PHARYNX_ROW, i], kept[OUTSIDE_ROW, i])
        if shared < a + band:
            o.gap[i] = band
        structure, least = 255, np.float32(0.4)
        for r in range(SOLID_ROWS):
            # Deep air is inside no solid; high over the head some have no end.
            if a >= -band and kept[r, i] < least:
                structure, least = r, kept[r, i]
        nasal = inside and t.parts[o.part[i], 3] % 10 == NASAL
        if structure == 255 and nasal and shared <= a + SHARED_MM:
            pharynx = kept[PHARYNX_ROW, i] <= shared
            structure = PHARYNX_ROW if pharynx else OUTSIDE_ROW
        o.structure[i] = structure
        o.density[i] = np.uint8(MEAN_DENSITY)
        if inside and a > -SHELL_MM:
            dense = F1 + UNEVEN_DENSITY * grain_at(
                p[0, i], p[1, i], p[2, i], 0, t.grain, t.perm, t.grad
            )
            dense = min(max(dense, LEAST_DENSITY), MOST_DENSITY)
            o.density[i] = np.uint8(np.float32(MEAN_DENSITY) * dense + HALF)
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
