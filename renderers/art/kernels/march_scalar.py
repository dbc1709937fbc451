"""March rays through cells; sample, classify, shade, composite.

Positions inside the loops are float32 voxel coordinates, counted from the ray's first
sample inside the volume, so that a camera a kilometre away costs no accuracy. Sample
``i`` of a ray lies at ``origin + i * step`` whatever was skipped before it and
whichever cell it falls into: that is why neither cell size, nor threads, nor the order
in which cells arrive can change a bit. A ray that meets a missing cell writes down
where it stopped and goes on later from there.

Ray arrays, one row per ray: ``order`` int32 rays to march, neighbours after each other;
``geometry`` float32 (origin x y z, step x y z in voxels,
step in mm, distance of sample 0 in mm); ``count`` int32 samples; ``cursor`` int32
(sample, stage, bracket, cell waited for + 1 or 0), stage in mode `classic` the sample
at which opacity passed one half, + 1, or 0; ``value`` float32 (r, g, b, alpha) or
(normal, coverage); ``carry`` float32, what adding to ``value`` has rounded away so far;
``depth`` float32 mm. cursor, value and carry end with a spare row.
"""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.art.cells.brick_views import CellView, Classification
from renderers.art.kernels.interpolate_scalar import U, trilinear
from renderers.art.kernels.opacity_scalar import HALF, ONE, ZERO, opacity
from renderers.art.kernels.shade_scalar import light_up

SLOWEST = np.float32(1e-6)
"""Voxels a sample; keeps reciprocals finite."""

WITHIN = np.float32(0.501)
"""Leaps end so much before empty space does, counted from a cube's middle. Positions
are good to 6e-5 voxel at 1024 voxels, so no rounding can leap over a sample that
counts."""

BISECTIONS = 6
"""Halvings of the step around a surface. In the sixty-fourth of a voxel that is left of
one voxel the field is all but straight, and its slope tells the rest."""

LAST_PART = np.float32(1 / (1 << BISECTIONS))
"""Width of the last bracket, in steps."""


@njit(cache=True, nogil=True, error_model="numpy")
def per_voxel(s: np.float32) -> np.float32:
    """Turn voxels per sample into samples per voxel, finite also across the axis."""
    # Faster than it is, towards the same side: leaps only become shorter.
    return ONE / (max(s, SLOWEST) if s >= ZERO else min(s, -SLOWEST))


@njit(cache=True, nogil=True, error_model="numpy")
def leap_out(
    x: np.float32, y: np.float32, z: np.float32,
    px: np.float32, py: np.float32, pz: np.float32,
    ix: int, iy: int, iz: int, distance: int, left: int,
) -> int:  # fmt: skip
    """Count the samples that surely lie in empty space, this one among them.

    ix, iy, iz: the cube the sample is in; cubes nearer than `distance` are empty too.
    px, py, pz: samples per voxel along the ray.
    """
    reach = np.float32(distance) - WITHIN
    out = (np.float32(ix) + HALF - x) * px + reach * abs(px)
    out = min(out, (np.float32(iy) + HALF - y) * py + reach * abs(py))
    out = min(out, (np.float32(iz) + HALF - z) * pz + reach * abs(pz))
    return int(min(max(out, ZERO), np.float32(left - 1))) + 1


@njit(cache=True, nogil=True, error_model="numpy")
def march_classic(
    order: NDArray[np.int32],
    geometry: NDArray[np.float32], count: NDArray[np.int32], cursor: NDArray[np.int32],
    value: NDArray[np.float32], carry: NDArray[np.float32], depth: NDArray[np.float32],
    view: CellView, shift: int, clock: int, table: Classification,
    lights: NDArray[np.float32], material: NDArray[np.float32],
    spacing: NDArray[np.float32],
    least_gradient: np.float32, cutoff: np.float32, renormalise: bool,
    counters: NDArray[np.int64],
) -> None:  # fmt: skip
    """Composite each ray front to back until it ends, is opaque, or misses a cell.

    lights: float32 (m, 10) vector in mm along the array's axes, diffuse and specular
    colour, is local. material: float32 (3,) ambient, specular, shininess. counters:
    int64 samples, contributing, skipped. clock: stamped on cells that are used; none
    when it is 0. Post-classified; the opacity of a step of length h is
    ``1 - exp(-kappa h)``. What a sum rounds away is added with the next term (Kahan,
    CACM 1965;8:40), so that a million thin steps add up.
    """
    mask = (1 << shift) - 1
    n1 = (1 << shift) + 1
    wide, high = int(view.top[0]) + 1, int(view.top[1]) + 1
    each = view.channels
    row, slab = each * n1, each * n1 * n1
    whole = each == 1 and len(view.whole) > 0
    field = view.whole if whole else view.samples
    if whole:
        row = each * (wide + 1)
        slab = row * (high + 1)
    total = np.empty(4, np.float32)
    lost = np.empty(4, np.float32)
    term = np.empty(4, np.float32)
    for ray in order:
        cursor[ray, 3] = 0
        i, end = cursor[ray, 0], count[ray]
        if i >= end:
            continue
        ox, oy, oz = geometry[ray, 0], geometry[ray, 1], geometry[ray, 2]
        sx, sy, sz = geometry[ray, 3], geometry[ray, 4], geometry[ray, 5]
        h = geometry[ray, 6]
        px, py, pz = per_voxel(sx), per_voxel(sy), per_voxel(sz)
        per_mm = ONE / h
        vx, vy = sx * spacing[0] * per_mm, sy * spacing[1] * per_mm
        vz = sz * spacing[2] * per_mm
        total[:] = value[ray]
        lost[:] = carry[ray]
        t = max((ONE - total[3]) - lost[3], ZERO)
        current, slot = -1, 0
        while i < end:
            fi = np.float32(i)
            x, y, z = ox + fi * sx, oy + fi * sy, oz + fi * sz
            ix = min(max(int(x), 0), view.top[0])
            iy = min(max(int(y), 0), view.top[1])
            iz = min(max(int(z), 0), view.top[2])
            far = int(view.leap[U((iz * high + iy) * wide + ix)])
            if far > 0:
                jump = leap_out(x, y, z, px, py, pz, ix, iy, iz, far, end - i)
                counters[2] += jump
                i += jump
                continue
            if whole:
                at = iz * slab + iy * row + ix * each
            else:
                cell = (iz >> shift) * view.counts[1] + (iy >> shift)
                cell = cell * view.counts[0] + (ix >> shift)
                if cell != current:
                    slot = view.slots[cell]
                    if slot < 0:
                        cursor[ray, 3] = cell + 1
                        break
                    current = cell
                    if clock > 0:
                        view.stamp[slot] = clock
                lx, ly, lz = ix & mask, iy & mask, iz & mask
                at = (((slot * n1 + lz) * n1 + ly) * n1 + lx) * each
            i += 1
            counters[0] += 1
            fx, fz = x - np.float32(ix), z - np.float32(iz)
            fy = min(max(y - np.float32(iy), ZERO), ONE)
            v = trilinear(field, at, each, row, slab, fx, fy, fz) * view.unit
            place = min(max((v - table.low) * table.scale + ONE, ZERO), table.last)
            bin_ = int(place)
            f = place - np.float32(bin_)
            line = table.lines[U(bin_)]
            kappa = line[0] + f * line[1]
            cr, cg, cb = (
                line[2] + f * line[3],
                line[4] + f * line[5],
                line[6] + f * line[7],
            )
            if kappa < ZERO:
                k = table.first[bin_]
                while v >= table.extinction[k, 1]:
                    k += 1
                dv = max(v - table.extinction[k, 0], ZERO)
                kappa = table.extinction[k, 2] + dv * table.extinction[k, 3]
                cr = table.color[k, 0] + dv * table.color_slope[k, 0]
                cg = table.color[k, 1] + dv * table.color_slope[k, 1]
                cb = table.color[k, 2] + dv * table.color_slope[k, 2]
            if kappa <= ZERO:
                continue
            counters[1] += 1
            if each > 1:
                gx = trilinear(view.samples, at + 1, each, row, slab, fx, fy, fz)
                gy = trilinear(view.samples, at + 2, each, row, slab, fx, fy, fz)
                gz = trilinear(view.samples, at + 3, each, row, slab, fx, fy, fz)
                cr, cg, cb = light_up(
                    lights, material, least_gradient, cr, cg, cb, gx, gy, gz,
                    x * spacing[0], y * spacing[1], z * spacing[2], vx, vy, vz,
                )  # fmt: skip
            weight = t * opacity(kappa * h)
            term[0], term[1], term[2] = weight * cr, weight * cg, weight * cb
            term[3] = weight
            for c_ in range(4):
                part = term[c_] + lost[c_]
                sum_ = total[c_] + part
                lost[c_] = part - (sum_ - total[c_])
                total[c_] = sum_
            t = max((ONE - total[3]) - lost[3], ZERO)
            if t <= HALF and depth[ray] == np.float32(np.inf):
                depth[ray] = geometry[ray, 7] + fi * h
            if t < cutoff:
                if renormalise:
                    k_ = ONE / (ONE - t)
                    for c_ in range(3):
                        total[c_] = (total[c_] + lost[c_]) * k_
                    total[3] = ONE
                    lost[:] = ZERO
                i = end
        cursor[ray, 0] = i
        value[ray] = total
        carry[ray] = lost


@njit(cache=True, nogil=True, error_model="numpy")
def march_scope(
    order: NDArray[np.int32],
    geometry: NDArray[np.float32], count: NDArray[np.int32], cursor: NDArray[np.int32],
    value: NDArray[np.float32], carry: NDArray[np.float32], depth: NDArray[np.float32],
    view: CellView, shift: int, clock: int, spacing: NDArray[np.float32],
    counters: NDArray[np.int64],
) -> None:  # fmt: skip
    """Find where each ray first meets density >= 0; write its depth and normal there.

    Stages of cursor: 0 leaps and samples; 1 to BISECTIONS halve the step before the
    first sample that is not negative; then the normal, towards negative density, is
    read at the bracket's far end, and its slope leads from there to the surface. Each
    stage reads one point and hence needs one cell. The bracket is kept as an integer,
    so that stopping and going on is exact. Of negative densities only the sign counts:
    skipping need not read them.
    """
    mask = (1 << shift) - 1
    n1 = (1 << shift) + 1
    wide, high = int(view.top[0]) + 1, int(view.top[1]) + 1
    row, slab = 4 * n1, 4 * n1 * n1
    whole, deep = len(view.whole) > 0, (wide + 1) * (high + 1)
    for ray in order:
        cursor[ray, 3] = 0
        i, stage, bracket = cursor[ray, 0], cursor[ray, 1], cursor[ray, 2]
        end = count[ray]
        ox, oy, oz = geometry[ray, 0], geometry[ray, 1], geometry[ray, 2]
        sx, sy, sz = geometry[ray, 3], geometry[ray, 4], geometry[ray, 5]
        px, py, pz = per_voxel(sx), per_voxel(sy), per_voxel(sz)
        current, slot = -1, 0
        while i < end:
            at_i = np.float32(i)
            if stage > 0 and i > 0:
                if stage <= BISECTIONS:
                    part = np.float32(2 * bracket + 1) / np.float32(1 << stage)
                else:
                    part = np.float32(bracket + 1) / np.float32(1 << BISECTIONS)
                at_i = np.float32(i - 1) + part
            x, y, z = ox + at_i * sx, oy + at_i * sy, oz + at_i * sz
            ix = min(max(int(x), 0), view.top[0])
            iy = min(max(int(y), 0), view.top[1])
            iz = min(max(int(z), 0), view.top[2])
            far = int(view.leap[U((iz * high + iy) * wide + ix)])
            v = -ONE
            if far > 0:
                if stage == 0:
                    jump = leap_out(x, y, z, px, py, pz, ix, iy, iz, far, end - i)
                    counters[2] += jump
                    i += jump
                    continue
            elif whole and stage <= BISECTIONS:
                counters[0] += 1
                fx, fy, fz = x - np.float32(ix), y - np.float32(iy), z - np.float32(iz)
                at = (iz * (high + 1) + iy) * (wide + 1) + ix
                v = trilinear(view.whole, at, 1, wide + 1, deep, fx, fy, fz)
            else:
                cell = (iz >> shift) * view.counts[1] + (iy >> shift)
                cell = cell * view.counts[0] + (ix >> shift)
                if cell != current:
                    slot = view.slots[cell]
                    if slot < 0:
                        cursor[ray, 3] = cell + 1
                        break
                    current = cell
                    if clock > 0:
                        view.stamp[slot] = clock
                lx, ly, lz = ix & mask, iy & mask, iz & mask
                counters[0] += 1
                fx, fy, fz = x - np.float32(ix), y - np.float32(iy), z - np.float32(iz)
                at = (((slot * n1 + lz) * n1 + ly) * n1 + lx) * 4
                if stage > BISECTIONS:
                    gx = trilinear(view.samples, at + 1, 4, row, slab, fx, fy, fz)
                    gy = trilinear(view.samples, at + 2, 4, row, slab, fx, fy, fz)
                    gz = trilinear(view.samples, at + 3, 4, row, slab, fx, fy, fz)
                    steep = math.sqrt(gx * gx + gy * gy + gz * gz)
                    value[ray, 0], value[ray, 1], value[ray, 2] = gx, gy, gz
                    if steep > ZERO:
                        value[ray, 0] = -gx / steep
                        value[ray, 1] = -gy / steep
                        value[ray, 2] = -gz / steep
                    value[ray, 3] = ONE
                    v = trilinear(view.samples, at, 4, row, slab, fx, fy, fz)
                    rise = gx * (sx * spacing[0]) + gy * (sy * spacing[1])
                    rise += gz * (sz * spacing[2])
                    back = ZERO
                    if rise > ZERO and i > 0:
                        back = min(v / rise, LAST_PART)
                    depth[ray] = geometry[ray, 7] + (at_i - back) * geometry[ray, 6]
                    counters[1] += 1
                    i = end
                    continue
                v = trilinear(view.samples, at, 4, row, slab, fx, fy, fz)
            if stage == 0:
                if v < ZERO:
                    i += 1
                else:
                    # At sample 0 the eye, or the volume's face, is in tissue.
                    stage = 1 if i > 0 else BISECTIONS + 1
                    bracket = 0
            else:
                bracket = 2 * bracket + (1 if v < ZERO else 0)
                stage += 1
        cursor[ray, 0], cursor[ray, 1], cursor[ray, 2] = i, stage, bracket
