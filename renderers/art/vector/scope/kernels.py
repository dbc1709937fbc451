"""Find the air surface for packets of rays; see `renderers.art.vector.kernels`.

Lanes that look for a surface leap; lanes that have one between two samples halve the
step; lanes that stand on it read the normal. All that stand somewhere read together,
whatever they read for.
"""

from collections.abc import Callable

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.art.kernels import BISECTIONS, LAST_PART, WITHIN
from renderers.art.optics.kernels import BIAS, DIGITS, ONE, ZERO
from renderers.art.vector.kernels import (
    F32,
    I32,
    per_voxel,
    queue_rays,
    stamp,
    way_out,
)
from renderers.art.views import ABSENT, CellView
from renderers.simd import (
    any_,
    as_f32,
    as_i32,
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
)

DONE = np.int32(BISECTIONS + 2)
"""Stage of a ray that has met a surface; its bracket holds the bits of its depth."""


def scope_packets(width: int) -> Callable[..., None]:
    """Make `march_scope` for packets of `width` rays, a power of two from 4."""
    refill = width // 2
    patience = 3 * width // 8

    @njit(cache=True, nogil=True, error_model="numpy")
    def march_scope(
        order: I32, geometry: F32, ends: I32, cursor: I32, value: F32, carry: F32,
        depth: F32, view: CellView, shift: int, clock: int,
        spacing: F32, counters: NDArray[np.int64],
    ) -> None:  # fmt: skip
        """Find where each ray first meets density >= 0; write depth and normal there.

        Arguments and stages as the scalar march has them.
        """
        n1 = np.int32((1 << shift) + 1)
        top_x, top_y, top_z = view.top[0], view.top[1], view.top[2]
        row, slab = top_x + np.int32(1), (top_x + np.int32(1)) * (top_y + np.int32(1))
        cells_x, cells_y = view.counts[0], view.counts[1]
        queue = np.empty(len(order), np.int32)
        total, _ = queue_rays(order, ends, cursor, queue)
        marks = np.empty(width, np.int32)
        spare = np.int32(len(value) - 1)
        n2 = n1 * n1
        head = 0
        zero = full(ZERO, width)
        ox, oy, oz, sx, sy, sz = zero, zero, zero, zero, zero, zero
        h, near, px, py, pz = zero, zero, zero, zero, zero
        nx, ny, nz, cover = zero, zero, zero, zero
        none = full(np.int32(0), width)
        i, end, last, ray, wait = none, none, none, none + spare, none
        stage, bracket, skipped = none, none, none
        samples, hits = 0, 0
        while True:
            free = i >= end
            idle = count(free)
            if idle == width or (idle >= refill and head < total):
                # Rays that are not free write down their state, too, and go on.
                put_rows4(cursor, ray, select(wait > 0, i, last), stage, bracket, wait)
                put_rows4(value, ray, nx, ny, nz, cover)
                if idle == width and head >= total:
                    break
                place = rank(free) + np.int32(head)
                new = free & (place < np.int32(total))
                head = min(head + idle, total)
                ray = select(free, spare, ray)
                ray = select(new, gather(queue, select(new, place, 0), new), ray)
                ox, oy, oz, sx, sy, sz, h, near = rows8(geometry, ray)
                nx, ny, nz, cover = rows4(value, ray)
                first, stages, brackets, _ = rows4(cursor, ray)
                i, stage = select(free, first, i), select(free, stages, stage)
                bracket = select(free, brackets, bracket)
                last = gather(ends, ray, ray < spare)
                end = select(free, last, end)
                wait = select(free, 0, wait)
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
                out = way_out(x - f32(ix), px, reach)
                out = minimum(out, way_out(y - f32(iy), py, reach))
                out = minimum(out, way_out(z - f32(iz), pz, reach))
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
            corner = gather(view.corners, cell, held)
            missing = held & (corner == ABSENT)
            if any_(missing):
                wait = select(missing, cell + 1, wait)
                end = select(missing, 0, end)
                held &= ~missing
                at &= ~missing
                if not any_(at):
                    continue
            v = zero - ONE
            gx, gy, gz = zero, zero, zero
            if any_(held):
                if clock > 0:
                    stamp(view.slots, cell, held, marks, view.stamp, clock)
                corner += iz * n2 + iy * n1 + ix
                read, gx, gy, gz = cell4(
                    view.samples, select(held, corner, 0), np.int64(n1),
                    np.int64(n1) * np.int64(n1), x - f32(ix), y - f32(iy), z - f32(iz),
                )  # fmt: skip
                samples += count(held)
                v = select(held, read, v)
            found = at & (stage > BISECTIONS)
            if any_(found):
                hits += count(found)
                steep = sqrt(gx * gx + gy * gy + gz * gz)
                sloped = steep > ZERO
                nx = select(found, select(sloped, -gx / steep, gx), nx)
                ny = select(found, select(sloped, -gy / steep, gy), ny)
                nz = select(found, select(sloped, -gz / steep, gz), nz)
                cover = select(found, ONE, cover)
                rise = gx * (sx * spacing[0]) + gy * (sy * spacing[1])
                rise += gz * (sz * spacing[2])
                inner = (rise > ZERO) & (i > 0)
                back = select(inner, minimum(v / rise, LAST_PART), ZERO)
                depths = as_i32(near + (at_i - back) * h)
                bracket = select(found, depths, bracket)
                stage = select(found, DONE, stage)
                end = select(found, 0, end)
                at &= ~found
            air = v < ZERO
            bracket = select(
                at & ~seeking, 2 * bracket + select(air, 1, 0 * i), bracket
            )
            begins = at & seeking & ~air
            begun = select(i > 0, 1, none + np.int32(BISECTIONS + 1))
            bracket = select(begins, 0, bracket)
            i = select(at & seeking & air, i + 1, i)
            stage = select(begins, begun, select(at & ~seeking, stage + 1, stage))
        for k in order:
            if cursor[k, 1] == DONE:
                depth[k] = cursor[k, 2:3].view(np.float32)[0]
        counters[0] += samples
        counters[1] += hits
        store(marks, 0, skipped)
        for lane in range(width):
            counters[2] += marks[lane]

    return march_scope
