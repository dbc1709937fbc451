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
from renderers.art.views import ABSENT, CellView, Classification
from renderers.simd import (
    absolute,
    any_,
    cell4,
    count,
    f32,
    full,
    gather,
    gather_u8,
    i32,
    maximum,
    minimum,
    put_rows4,
    rank,
    rows4,
    rows8,
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
def queue_rays(order: I32, ends: I32, cursor: I32, queue: I32) -> int:
    """List the unfinished rays in their order; give their number.

    queue: int32, at least as long as `order`.
    """
    found = 0
    for ray in order:
        cursor[ray, 3] = 0
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


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def add(total: Lanes, lost: Lanes, term: Lanes, on: Lanes) -> tuple[Lanes, Lanes]:
    """Give sums with a term more where on, and what they have rounded away by now."""
    part = term + lost
    more = total + part
    return select(on, more, total), select(on, part - (more - total), lost)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def stamp(
    slots: I32, cell: Lanes, at: Lanes, marks: I32, used: NDArray[np.int64], clock: int
) -> None:
    """Write the time on the slots of the cells that lanes stand in."""
    store_packed(marks, 0, gather(slots, cell, at), at)
    for k in range(count(at)):
        used[marks[k]] = clock


def classic_packets(width: int) -> Callable[..., None]:
    """Make `march_classic` for packets of `width` rays, a power of two from 4."""
    refill = width // 2
    patience = 3 * width // 8

    @njit(cache=True, nogil=True, error_model="numpy")
    def march_classic(
        order: I32, geometry: F32, ends: I32, cursor: I32, value: F32, carry: F32,
        depth: F32, view: CellView, shift: int, clock: int,
        table: Classification, lights: F32, material: F32, spacing: F32,
        least_gradient: np.float32, cutoff: np.float32, renormalise: bool,
        counters: NDArray[np.int64],
    ) -> None:  # fmt: skip
        """Composite each ray until it ends, is opaque, or misses a cell.

        Arguments as the scalar march has them.
        """
        n1 = np.int32((1 << shift) + 1)
        top_x, top_y, top_z = view.top[0], view.top[1], view.top[2]
        row, slab = top_x + np.int32(1), (top_x + np.int32(1)) * (top_y + np.int32(1))
        cells_x, cells_y = view.counts[0], view.counts[1]
        queue = np.empty(len(order), np.int32)
        total = queue_rays(order, ends, cursor, queue)
        marks = np.empty(width, np.int32)
        spare = np.int32(len(value) - 1)
        n2 = n1 * n1
        head = 0
        zero = full(ZERO, width)
        ox, oy, oz, sx, sy, sz = zero, zero, zero, zero, zero, zero
        h, per_mm, px, py, pz = zero, zero, zero, zero, zero
        r, g, b, a, t = zero, zero, zero, zero, zero
        lr, lg, lb, la = zero, zero, zero, zero
        none = full(np.int32(0), width)
        i, end, last, ray, half, wait = none, none, none, none + spare, none, none
        skipped = none
        samples, contributing = 0, 0
        while True:
            free = i >= end
            idle = count(free)
            if idle == width or (idle >= refill and head < total):
                if renormalise:
                    cut = free & (t < cutoff)
                    k_ = ONE / (ONE - t)
                    r = select(cut, (r + lr) * k_, r)
                    g = select(cut, (g + lg) * k_, g)
                    b, a = select(cut, (b + lb) * k_, b), select(cut, ONE, a)
                    lr, lg = select(cut, ZERO, lr), select(cut, ZERO, lg)
                    lb, la = select(cut, ZERO, lb), select(cut, ZERO, la)
                # Rays that are not free write down their state, too, and go on.
                put_rows4(cursor, ray, select(wait > 0, i, last), half, none, wait)
                put_rows4(value, ray, r, g, b, a)
                put_rows4(carry, ray, lr, lg, lb, la)
                if idle == width and head >= total:
                    break
                place = rank(free) + np.int32(head)
                new = free & (place < np.int32(total))
                head = min(head + idle, total)
                ray = select(free, spare, ray)
                ray = select(new, gather(queue, select(new, place, 0), new), ray)
                ox, oy, oz, sx, sy, sz, h, _ = rows8(geometry, ray)
                r, g, b, a = rows4(value, ray)
                lr, lg, lb, la = rows4(carry, ray)
                first, marked, _, _ = rows4(cursor, ray)
                i, half = select(free, first, i), select(free, marked, half)
                last = gather(ends, ray, ray < spare)
                end = select(free, last, end)
                wait = select(free, 0, wait)
                t = maximum((ONE - a) - la, ZERO)
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
            corner = gather(view.corners, cell, at)
            missing = at & (corner == ABSENT)
            if any_(missing):
                wait = select(missing, cell + 1, wait)
                end = select(missing, 0, end)
                at &= ~missing
                if not any_(at):
                    continue
            if clock > 0:
                stamp(view.slots, cell, at, marks, view.stamp, clock)
            corner += iz * n2 + iy * n1 + ix
            fy = minimum(maximum(y - f32(iy), ZERO), ONE)
            v, gx, gy, gz = cell4(
                view.samples, select(at, corner, 0), np.int64(n1),
                np.int64(n1) * np.int64(n1), x - f32(ix), fy, z - f32(iz),
            )  # fmt: skip
            v *= view.unit
            place = (v - table.low) * table.scale + ONE
            place = minimum(maximum(place, ZERO), table.last)
            bin_ = i32(place)
            f = place - f32(bin_)
            kappa, k0, cr, a0, cg, a1, cb, a2 = rows8(table.lines, bin_)
            kappa, cr, cg, cb = kappa + f * k0, cr + f * a0, cg + f * a1, cb + f * a2
            mixed = at & (kappa < ZERO)
            if any_(mixed):
                segment = gather(table.first, select(mixed, bin_, 0), mixed)
                lower, upper, k0, k1 = rows4(table.extinction, segment)
                later = mixed & (v >= upper)
                while any_(later):
                    segment = select(later, segment + 1, segment)
                    lower, upper, k0, k1 = rows4(table.extinction, segment)
                    later = mixed & (v >= upper)
                dv = maximum(v - lower, ZERO)
                kappa = select(mixed, k0 + dv * k1, kappa)
                a0, a1, a2, _ = rows4(table.color, segment)
                k0, k1, k2, _ = rows4(table.color_slope, segment)
                cr = select(mixed, a0 + dv * k0, cr)
                cg = select(mixed, a1 + dv * k1, cg)
                cb = select(mixed, a2 + dv * k2, cb)
            samples += count(at)
            i = select(at, i + 1, i)
            seen = at & (kappa > ZERO)
            found = count(seen)
            if found == 0:
                continue
            contributing += found
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
                    if lights[m, 9] > ZERO:
                        qx, qy, qz = unit(
                            qx - x * spacing[0],
                            qy - y * spacing[1],
                            qz - z * spacing[2],
                        )
                    c = maximum(nx * qx + ny * qy + nz * qz, ZERO)
                    dr += c * lights[m, 3]
                    dg += c * lights[m, 4]
                    db += c * lights[m, 5]
                    if material[1] > ZERO:
                        hx = qx - sx * spacing[0] * per_mm
                        hy = qy - sy * spacing[1] * per_mm
                        hz = qz - sz * spacing[2] * per_mm
                        q = maximum(sqrt(hx * hx + hy * hy + hz * hz), TINY)
                        c = maximum((nx * hx + ny * hy + nz * hz) / q, ZERO)
                        c = power(c, material[2])
                        er += c * lights[m, 6]
                        eg += c * lights[m, 7]
                        eb += c * lights[m, 8]
                lit = steep > least_gradient
                cr = select(lit, cr * dr + er, cr)
                cg = select(lit, cg * dg + eg, cg)
                cb = select(lit, cb * db + eb, cb)
            weight = t * opacity(kappa * h)
            r, lr = add(r, lr, weight * cr, seen)
            g, lg = add(g, lg, weight * cg, seen)
            b, lb = add(b, lb, weight * cb, seen)
            a, la = add(a, la, weight, seen)
            t = maximum((ONE - a) - la, ZERO)
            half = select(seen & (t <= HALF) & (half == 0), i, half)
            cut = seen & (t < cutoff)
            end = select(cut, 0, end)
        for k in order:
            if cursor[k, 1] > 0 and depth[k] == FAR:
                depth[k] = (
                    geometry[k, 7] + np.float32(cursor[k, 1] - 1) * geometry[k, 6]
                )
        counters[0] += samples
        counters[1] += contributing
        store(marks, 0, skipped)
        for lane in range(width):
            counters[2] += marks[lane]

    return march_classic
