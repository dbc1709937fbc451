"""March packets of rays: the steps of `renderers.art.kernels`, many rays at a time.

Every lane holds a ray. Lanes that end are refilled from the queue; lanes in empty space
leap until most lanes stand where there may be something; those sample, classify,
shade and composite together. Each ray sees the operations of the scalar march in their
order, whatever its neighbours do: neither the width nor the order of rays changes a
bit. Distances over empty space are read voxel by voxel for the whole volume, so that
rays leap through missing cells and stop only where they need one.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.art.kernels import SLOWEST, WITHIN
from renderers.art.optics.kernels import HALF, ONE, ZERO
from renderers.art.vector.optics.kernels import opacity, power
from renderers.art.views import CellView, Classification
from renderers.simd import (
    absolute,
    any_,
    bits,
    cell4_real,
    count,
    f32,
    full,
    gather,
    gather_u8,
    i32,
    maximum,
    minimum,
    rank,
    rows4,
    select,
    sqrt,
    store,
    store_packed,
)

Lanes = Any
"""A vector of `renderers.simd`."""

F32 = NDArray[np.float32]
I32 = NDArray[np.int32]

TINY = np.float32(1e-6)
FAR = np.float32(np.inf)


@njit(cache=True, nogil=True, error_model="numpy")
def queue_rays(order: I32, ends: I32, cursor: I32, waiting: I32, queue: I32) -> int:
    """List the unfinished rays in their order; give their number.

    queue: int32, at least as long as `order`.
    """
    found = 0
    for ray in order:
        waiting[ray] = -1
        if cursor[ray, 0] < ends[ray]:
            queue[found] = ray
            found += 1
    return found


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def per_voxel(s: Lanes) -> Lanes:
    """Turn voxels per sample into samples per voxel, finite also across the axis."""
    return ONE / select(s >= ZERO, maximum(s, SLOWEST), minimum(s, -SLOWEST))


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def way_out(middle: Lanes, p: Lanes, reach: Lanes) -> Lanes:
    """Count samples along one axis out of the empty cubes around.

    middle: from the sample to the middle of its cube. p: samples per voxel. reach:
    from that middle to where leaps along the axis end.
    """
    return middle * p + reach * absolute(p)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def unit(x: Lanes, y: Lanes, z: Lanes) -> tuple[Lanes, Lanes, Lanes]:
    """Give vectors of length one."""
    scale = ONE / maximum(sqrt(x * x + y * y + z * z), TINY)
    return x * scale, y * scale, z * scale


def classic_packets(width: int) -> Callable[..., None]:
    """Make `march_classic` for packets of `width` rays, a power of two from 4."""
    refill = width // 2
    patience = 3 * width // 8

    @njit(cache=True, nogil=True, error_model="numpy")
    def march_classic(
        order: I32, geometry: F32, ends: I32, cursor: I32, value: F32, depth: F32,
        waiting: I32, view: CellView, shift: int, clock: int, table: Classification,
        lights: F32, material: F32, spacing: F32, least_gradient: np.float32,
        cutoff: np.float32, renormalise: bool, counters: NDArray[np.int64],
    ) -> None:  # fmt: skip
        """Composite each ray until it ends, is opaque, or misses a cell.

        Arguments as the scalar march has them.
        """
        mask = np.int32((1 << shift) - 1)
        n1 = np.int32((1 << shift) + 1)
        top_x, top_y, top_z = view.top[0], view.top[1], view.top[2]
        row, slab = top_x + np.int32(1), (top_x + np.int32(1)) * (top_y + np.int32(1))
        cells_x, cells_y = view.counts[0], view.counts[1]
        queue = np.empty(len(order), np.int32)
        total = queue_rays(order, ends, cursor, waiting, queue)
        results, marks = np.empty(5 * width, np.float32), np.empty(3 * width, np.int32)
        last_bin = np.float32(len(table.bins) - 1)
        head = 0
        zero = full(ZERO, width)
        ox, oy, oz, sx, sy, sz = zero, zero, zero, zero, zero, zero
        h, near, per_mm, px, py, pz = zero, zero, zero, zero, zero, zero
        r, g, b, t, d = zero, zero, zero, zero, zero
        none = full(np.int32(0), width) - 1
        i, end, ray, wait, current = none + 1, none + 1, none, none, none
        skipped = none + 1
        samples, contributing, entered = 0, 0, 0
        while True:
            free = i >= end
            idle = count(free)
            if idle == width or (idle >= refill and head < total):
                store(results, 0, r)
                store(results, width, g)
                store(results, 2 * width, b)
                store(results, 3 * width, t)
                store(results, 4 * width, d)
                store(marks, 0, ray)
                store(marks, width, i)
                store(marks, 2 * width, wait)
                word = bits(free & (ray >= 0))
                for lane in range(width):
                    if (word >> lane) & 1:
                        k = marks[lane]
                        value[k, 0] = results[lane]
                        value[k, 1] = results[width + lane]
                        value[k, 2] = results[2 * width + lane]
                        value[k, 3] = results[3 * width + lane]
                        depth[k] = results[4 * width + lane]
                        cursor[k, 0] = marks[width + lane]
                        waiting[k] = marks[2 * width + lane]
                if idle == width and head >= total:
                    break
                place = rank(free) + np.int32(head)
                new = free & (place < np.int32(total))
                head = min(head + idle, total)
                ray = select(free, -1, ray)
                ray = select(new, gather(queue, select(new, place, 0), new), ray)
                at_row = select(new, ray, 0)
                a0, a1, a2, a3 = rows4(geometry, at_row * 2)
                ox, oy = select(new, a0, ox), select(new, a1, oy)
                oz, sx = select(new, a2, oz), select(new, a3, sx)
                a0, a1, a2, a3 = rows4(geometry, at_row * 2 + 1)
                sy, sz = select(new, a0, sy), select(new, a1, sz)
                h, near = select(new, a2, h), select(new, a3, near)
                a0, a1, a2, a3 = rows4(value, at_row)
                r, g = select(new, a0, r), select(new, a1, g)
                b, t = select(new, a2, b), select(new, a3, t)
                d = select(new, gather(depth, at_row, new), d)
                i = select(free, gather(cursor, at_row * 3, new), i)
                end = select(free, gather(ends, at_row, new), end)
                wait = select(free, -1, wait)
                current = select(free, -1, current)
                per_mm = ONE / h
                px, py, pz = per_voxel(sx), per_voxel(sy), per_voxel(sz)
                continue
            while True:
                on = i < end
                fi = f32(i)
                x, y, z = ox + fi * sx, oy + fi * sy, oz + fi * sz
                ix = minimum(i32(x), top_x)
                iy = minimum(i32(y), top_y)
                iz = minimum(i32(z), top_z)
                cube = select(on, iz * slab + iy * row + ix, 0)
                far = gather_u8(view.leap, cube, on)
                leaps = far > 0
                at = on & ~leaps
                reach = f32(far) - WITHIN
                out = way_out(f32(ix) + HALF - x, px, reach)
                out = minimum(out, way_out(f32(iy) + HALF - y, py, reach))
                out = minimum(out, way_out(f32(iz) + HALF - z, pz, reach))
                out = minimum(maximum(out, ZERO), f32(end - i - 1))
                jump = i32(out) + 1
                jump = select(leaps, jump, 0)
                i += jump
                skipped += jump
                if count(leaps) <= patience:
                    break
            if not any_(at):
                continue
            cell = (iz >> shift) * cells_y + (iy >> shift)
            cell = select(at, cell * cells_x + (ix >> shift), 0)
            slot = gather(view.slots, cell, at)
            missing = at & (slot < 0)
            if any_(missing):
                wait = select(missing, cell, wait)
                end = select(missing, 0, end)
                at &= ~missing
                if not any_(at):
                    continue
            fresh = at & (slot != current)
            changed = count(fresh)
            current = select(fresh, slot, current)
            entered += changed
            if clock > 0 and changed > 0:
                store_packed(marks, 0, slot, fresh)
                for k in range(changed):
                    view.stamp[marks[k]] = clock
            corner = ((slot * n1 + (iz & mask)) * n1 + (iy & mask)) * n1 + (ix & mask)
            v, gx, gy, gz = cell4_real(
                view.samples, select(at, corner, 0), np.int64(n1),
                np.int64(n1) * np.int64(n1), x - f32(ix), y - f32(iy), z - f32(iz),
            )  # fmt: skip
            bin_ = minimum(maximum((v - table.low) * table.scale, ZERO), last_bin)
            segment = gather(table.bins, select(at, i32(bin_), 0), at)
            lower, upper, kappa, steeper = rows4(table.extinction, segment)
            later = at & (v >= upper)
            while any_(later):
                segment = select(later, segment + 1, segment)
                lower, upper, kappa, steeper = rows4(table.extinction, segment)
                later = at & (v >= upper)
            dv = maximum(v - lower, ZERO)
            kappa += dv * steeper
            samples += count(at)
            i = select(at, i + 1, i)
            seen = at & (kappa > ZERO)
            found = count(seen)
            if found == 0:
                continue
            contributing += found
            cr, cg, cb, _ = rows4(table.color, segment)
            a0, a1, a2, a3 = rows4(table.color_slope, segment)
            cr, cg, cb = cr + dv * a0, cg + dv * a1, cb + dv * a2
            if len(lights) > 0 or material[0] != ONE:
                steep = sqrt(gx * gx + gy * gy + gz * gz)
                inverse = -ONE / steep
                nx, ny, nz = gx * inverse, gy * inverse, gz * inverse
                dr = zero + material[0]
                dg, db, er, eg, eb = dr, dr, zero, zero, zero
                for m in range(len(lights)):
                    qx, qy, qz = (
                        zero + lights[m, 0],
                        zero + lights[m, 1],
                        zero + lights[m, 2],
                    )
                    if lights[m, 6] > ZERO:
                        qx, qy, qz = unit(
                            qx - x * spacing[0],
                            qy - y * spacing[1],
                            qz - z * spacing[2],
                        )
                    c = material[1] * maximum(nx * qx + ny * qy + nz * qz, ZERO)
                    dr += c * lights[m, 3]
                    dg += c * lights[m, 4]
                    db += c * lights[m, 5]
                    if material[2] > ZERO:
                        hx = qx - sx * spacing[0] * per_mm
                        hy = qy - sy * spacing[1] * per_mm
                        hz = qz - sz * spacing[2] * per_mm
                        q = maximum(sqrt(hx * hx + hy * hy + hz * hz), TINY)
                        c = maximum((nx * hx + ny * hy + nz * hz) / q, ZERO)
                        c = material[2] * power(c, material[3])
                        er += c * lights[m, 3]
                        eg += c * lights[m, 4]
                        eb += c * lights[m, 5]
                lit = steep > least_gradient
                cr = select(lit, cr * dr + er, cr)
                cg = select(lit, cg * dg + eg, cg)
                cb = select(lit, cb * db + eb, cb)
            weight = select(seen, t * opacity(kappa * h), ZERO)
            r = select(seen, r + weight * cr, r)
            g = select(seen, g + weight * cg, g)
            b = select(seen, b + weight * cb, b)
            t -= weight
            d = select(seen & (t <= HALF) & (d == FAR), near + fi * h, d)
            cut = seen & (t < cutoff)
            if any_(cut):
                if renormalise:
                    k_ = ONE / (ONE - t)
                    r, g = select(cut, r * k_, r), select(cut, g * k_, g)
                    b, t = select(cut, b * k_, b), select(cut, ZERO, t)
                i = select(cut, end, i)
        counters[0] += samples
        counters[1] += contributing
        store(marks, 0, skipped)
        for lane in range(width):
            counters[2] += marks[lane]
        counters[3] += entered

    return march_classic
