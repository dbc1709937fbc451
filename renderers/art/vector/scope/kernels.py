"""Find the air surface for packets of rays; see `renderers.art.vector.kernels`.

Lanes that look for a surface leap; lanes that have one between two samples halve the
step; lanes that stand on it read the normal. All that stand somewhere read together,
whatever they read for.
"""

from collections.abc import Callable

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.art.kernels import BISECTIONS, WITHIN
from renderers.art.optics.kernels import BIAS, DIGITS, HALF, ONE, ZERO
from renderers.art.vector.kernels import F32, I32, per_voxel, queue_rays, way_out
from renderers.art.views import CellView
from renderers.simd import (
    any_,
    as_f32,
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


def scope_packets(width: int) -> Callable[..., None]:
    """Make `march_scope` for packets of `width` rays, a power of two from 4."""
    refill = width // 2
    patience = 3 * width // 8

    @njit(cache=True, nogil=True, error_model="numpy")
    def march_scope(
        order: I32, geometry: F32, ends: I32, cursor: I32, value: F32, depth: F32,
        waiting: I32, view: CellView, shift: int, clock: int,
        counters: NDArray[np.int64],
    ) -> None:  # fmt: skip
        """Find where each ray first meets density >= 0; write depth and normal there.

        Arguments and stages as the scalar march has them.
        """
        mask = np.int32((1 << shift) - 1)
        n1 = np.int32((1 << shift) + 1)
        top_x, top_y, top_z = view.top[0], view.top[1], view.top[2]
        row, slab = top_x + np.int32(1), (top_x + np.int32(1)) * (top_y + np.int32(1))
        cells_x, cells_y = view.counts[0], view.counts[1]
        queue = np.empty(len(order), np.int32)
        total = queue_rays(order, ends, cursor, waiting, queue)
        results, marks = np.empty(5 * width, np.float32), np.empty(5 * width, np.int32)
        head = 0
        zero = full(ZERO, width)
        ox, oy, oz, sx, sy, sz = zero, zero, zero, zero, zero, zero
        h, near, px, py, pz = zero, zero, zero, zero, zero
        nx, ny, nz, cover, d = zero, zero, zero, zero, zero
        none = full(np.int32(0), width) - 1
        i, end, ray, wait, current = none + 1, none + 1, none, none, none
        stage, bracket, skipped = i, i, i
        samples, hits, entered = 0, 0, 0
        while True:
            free = i >= end
            idle = count(free)
            if idle == width or (idle >= refill and head < total):
                store(results, 0, nx)
                store(results, width, ny)
                store(results, 2 * width, nz)
                store(results, 3 * width, cover)
                store(results, 4 * width, d)
                store(marks, 0, ray)
                store(marks, width, i)
                store(marks, 2 * width, stage)
                store(marks, 3 * width, bracket)
                store(marks, 4 * width, wait)
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
                        cursor[k, 1] = marks[2 * width + lane]
                        cursor[k, 2] = marks[3 * width + lane]
                        waiting[k] = marks[4 * width + lane]
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
                nx, ny = select(new, a0, nx), select(new, a1, ny)
                nz, cover = select(new, a2, nz), select(new, a3, cover)
                d = select(new, gather(depth, at_row, new), d)
                i = select(free, gather(cursor, at_row * 3, new), i)
                stage = select(free, gather(cursor, at_row * 3 + 1, new), stage)
                bracket = select(free, gather(cursor, at_row * 3 + 2, new), bracket)
                end = select(free, gather(ends, at_row, new), end)
                wait = select(free, -1, wait)
                current = select(free, -1, current)
                px, py, pz = per_voxel(sx), per_voxel(sy), per_voxel(sz)
                continue
            while True:
                on = i < end
                seeking = stage == 0
                halving = stage <= BISECTIONS
                parts = select(halving, 2 * bracket + 1, bracket + 1)
                halves = minimum(stage, BISECTIONS)
                part = f32(parts) * as_f32((BIAS - halves) << DIGITS)
                at_i = select(seeking | (i == 0), f32(i), f32(i - 1) + part)
                x, y, z = ox + at_i * sx, oy + at_i * sy, oz + at_i * sz
                ix = minimum(i32(x), top_x)
                iy = minimum(i32(y), top_y)
                iz = minimum(i32(z), top_z)
                cube = select(on, iz * slab + iy * row + ix, 0)
                far = gather_u8(view.leap, cube, on)
                leaps = on & seeking & (far > 0)
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
            at = on & ~leaps
            if not any_(at):
                continue
            held = at & (far == 0)
            cell = (iz >> shift) * cells_y + (iy >> shift)
            cell = select(held, cell * cells_x + (ix >> shift), 0)
            slot = gather(view.slots, cell, held)
            missing = held & (slot < 0)
            if any_(missing):
                wait = select(missing, cell, wait)
                end = select(missing, 0, end)
                held &= ~missing
                at &= ~missing
                if not any_(at):
                    continue
            v = zero - ONE
            gx, gy, gz = zero, zero, zero
            if any_(held):
                fresh = held & (slot != current)
                changed = count(fresh)
                if changed:
                    current = select(fresh, slot, current)
                    entered += changed
                    store_packed(marks, 0, slot, fresh)
                    for k in range(changed):
                        view.stamp[marks[k]] = clock
                corner = (slot * n1 + (iz & mask)) * n1 + (iy & mask)
                corner = select(held, corner * n1 + (ix & mask), 0)
                read, gx, gy, gz = cell4_real(
                    view.samples, corner, np.int64(n1), np.int64(n1) * np.int64(n1),
                    x - f32(ix), y - f32(iy), z - f32(iz),
                )  # fmt: skip
                samples += count(held)
                v = select(held, read, v)
            last = at & (stage > BISECTIONS)
            if any_(last):
                hits += count(last)
                steep = sqrt(gx * gx + gy * gy + gz * gz)
                sloped = steep > ZERO
                nx = select(last, select(sloped, -gx / steep, gx), nx)
                ny = select(last, select(sloped, -gy / steep, gy), ny)
                nz = select(last, select(sloped, -gz / steep, gz), nz)
                cover = select(last, ONE, cover)
                d = select(last, near + at_i * h, d)
                i = select(last, end, i)
                at &= ~last
            air = v < ZERO
            bracket = select(
                at & ~seeking, 2 * bracket + select(air, 1, 0 * i), bracket
            )
            begins = at & seeking & ~air
            first = select(i > 0, 1, none + np.int32(BISECTIONS + 2))
            bracket = select(begins, 0, bracket)
            i = select(at & seeking & air, i + 1, i)
            stage = select(begins, first, select(at & ~seeking, stage + 1, stage))
        counters[0] += samples
        counters[1] += hits
        store(marks, 0, skipped)
        for lane in range(width):
            counters[2] += marks[lane]
        counters[3] += entered

    return march_scope
