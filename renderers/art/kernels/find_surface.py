"""Find the air surface for packets of rays.

A ray meets the surface where density, sampled at both ends of its steps, is first not
negative. Stages of ``cursor[:, 1]``: 0 leaps and samples; 1 to BISECTIONS halve the
step before that sample; then the normal, towards negative density, is read at the
bracket's far end, and its slope leads from there to the surface. Each stage reads one
point and hence needs one cell. ``cursor[:, 2]``, the bracket, is a whole number, so
that stopping and going on is exact. Of negative densities only the sign counts:
skipping need not read them. The rays' arrays and their packets are those of
`renderers.art.kernels.march_packets`.

Lanes that look for a surface leap; lanes that have one between two samples halve the
step; all that stand somewhere read values together, whatever they read for. Rays that
have their surface leave the lanes; in the end the normals of all are read, in full
packets. Until then no gradient is: from a whole volume that is a third of the work.
"""

from collections.abc import Callable

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.art.cells.brick_views import ABSENT, CellView
from renderers.art.kernels.march_packets import F32, I32, queue_rays, stamp
from renderers.art.kernels.opacity import BIAS, DIGITS, ONE, ZERO
from renderers.art.kernels.skip import leap, per_voxel, stand
from renderers.lanes import (
    any_,
    as_f32,
    as_i32,
    cell1,
    cell4,
    count,
    f32,
    full,
    gather,
    gather_u8,
    lanes,
    load,
    minimum,
    put_rows4,
    rows4,
    rows8,
    select,
    sqrt,
    store,
    store_packed,
)

BISECTIONS = 6
"""Halvings of the step around a surface. In the sixty-fourth of a voxel that is left of
one voxel the field is all but straight, and its slope tells the rest."""

LAST_PART = np.float32(1 / (1 << BISECTIONS))
"""Width of the last bracket, in steps."""

DONE = np.int32(BISECTIONS + 2)
"""Stage of a ray that has met a surface; its bracket holds the bits of its depth."""


@njit(cache=True, nogil=True, error_model="numpy")
def queue_hits(order: I32, ends: I32, cursor: I32, queue: I32) -> int:
    """List the rays that have their surface between two samples; give their number."""
    found = 0
    for ray in order:
        stops = cursor[ray, 3] == 0 and cursor[ray, 0] < ends[ray]
        if stops and cursor[ray, 1] == BISECTIONS + 1:
            queue[found] = ray
            found += 1
    return found


def seek_packets(width: int) -> Callable[..., None]:
    """Make the search for surfaces, for packets of `width` rays, a power of two from 4.

    Rays that have one between two samples are left to `settle_packets`.
    """
    patience = 3 * width // 8

    @njit(cache=True, nogil=True, error_model="numpy")
    def seek_scope(
        order: I32, geometry: F32, ends: I32, cursor: I32, value: F32, carry: F32,
        depth: F32, view: CellView, shift: int, clock: int,
        spacing: F32, counters: NDArray[np.int64],
    ) -> None:  # fmt: skip
        """Bracket where each ray first meets density >= 0.

        Arguments as `classic_packets` has them.
        """
        whole = len(view.whole) > 0
        n1 = np.int32((1 << shift) + 1)
        n2 = n1 * n1
        top_x, top_y, top_z = view.top[0], view.top[1], view.top[2]
        row, slab = top_x + np.int32(1), (top_x + np.int32(1)) * (top_y + np.int32(1))
        wide = top_x + np.int32(2)
        deep = wide * (top_y + np.int32(2))
        cells_x, cells_y = view.counts[0], view.counts[1]
        queue = np.empty(2 * len(order) + width, np.int32)
        marks = np.empty(width, np.int32)
        spare = np.int32(len(value) - 1)
        total, _ = queue_rays(order, ends, cursor, spare, queue)
        zero = full(ZERO, width)
        none = full(np.int32(0), width)
        skipped, samples = none, 0
        head = 0
        while head < total:
            ray = load(queue, head, width)
            head += width
            few = patience if head < total else 0
            ox, oy, oz, sx, sy, sz, _, _ = rows8(geometry, ray)
            px, py, pz = per_voxel(sx), per_voxel(sy), per_voxel(sz)
            i, stage, bracket, _ = rows4(cursor, ray)
            last, wait = gather(ends, ray, ray < spare), none
            end = select(stage > BISECTIONS, 0, last)
            while count(i < end) > few:
                on = i < end
                seeking = stage == 0
                halves = minimum(stage, BISECTIONS)
                part = f32(2 * bracket + 1) * as_f32((BIAS - halves) << DIGITS)
                at_i = select(seeking | (i == 0), f32(i), f32(i - 1) + part)
                ix, iy, iz, fx, fy, fz = stand(
                    at_i, ox, oy, oz, sx, sy, sz, top_x, top_y, top_z
                )
                far = gather_u8(view.leap, iz * slab + iy * row + ix, on)
                leaps = on & seeking & (far > 0)
                jump = leap(leaps, far, fx, fy, fz, px, py, pz, end - i)
                i += jump
                skipped += jump
                at = on & ~leaps
                if count(leaps) > patience or not any_(at):
                    continue
                held = at & (far == 0)
                v = zero - ONE
                if whole:
                    corner = select(held, iz * deep + iy * wide + ix, 0)
                    steps = np.int64(wide), np.int64(deep)
                    read = cell1(view.whole, corner, steps[0], steps[1], fx, fy, fz)
                    v = select(held, read, v)
                else:
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
                    if clock > 0:
                        stamp(view.slots, cell, held, marks, view.stamp, clock)
                    corner = select(held, corner + (iz * n2 + iy * n1 + ix), 0)
                    read, _, _, _ = cell4(
                        view.samples, corner, np.int64(n1), np.int64(n2), fx, fy, fz
                    )
                    v = select(held, read, v)
                samples += count(held)
                air = v < ZERO
                bracket = select(
                    at & ~seeking, 2 * bracket + select(air, 1, none), bracket
                )
                begins = at & seeking & ~air
                begun = select(i > 0, 1, none + np.int32(BISECTIONS + 1))
                bracket = select(begins, 0, bracket)
                i = select(at & seeking & air, i + 1, i)
                stage = select(begins, begun, select(at & ~seeking, stage + 1, stage))
                end = select(stage > BISECTIONS, 0, end)
            left = i < end
            if any_(left):
                store_packed(queue, total, ray, left)
                total += count(left)
            # Rays that have their surface say so; the others have left, or wait.
            stays = left | (wait > 0) | (stage > BISECTIONS)
            put_rows4(cursor, ray, select(stays, i, last), stage, bracket, wait)
        counters[0] += samples
        store(marks, 0, skipped)
        for lane in range(width):
            counters[2] += marks[lane]

    return seek_scope


def settle_packets(width: int) -> Callable[..., None]:
    """Make what reads depths and normals where `seek_packets` found surfaces."""

    @njit(cache=True, nogil=True, error_model="numpy")
    def settle_scope(
        order: I32, geometry: F32, ends: I32, cursor: I32, value: F32, carry: F32,
        depth: F32, view: CellView, shift: int, clock: int,
        spacing: F32, counters: NDArray[np.int64],
    ) -> None:  # fmt: skip
        """Read value and gradient of rays at the far ends of their brackets."""
        queue = np.empty(len(order), np.int32)
        total = queue_hits(order, ends, cursor, queue)
        n1 = np.int32((1 << shift) + 1)
        n2 = n1 * n1
        step, deep = np.int64(n1), np.int64(n2)
        top_x, top_y, top_z = view.top[0], view.top[1], view.top[2]
        cells_x, cells_y = view.counts[0], view.counts[1]
        marks = np.empty(width, np.int32)
        spare = np.int32(len(value) - 1)
        zero = full(ZERO, width)
        for head in range(0, total, width):
            place = lanes(width) + np.int32(head)
            on = place < np.int32(total)
            ray = select(on, gather(queue, select(on, place, 0), on), spare)
            ox, oy, oz, sx, sy, sz, h, near = rows8(geometry, ray)
            i, stage, bracket, _ = rows4(cursor, ray)
            part = f32(bracket + 1) * LAST_PART
            at_i = select(i == 0, f32(i), f32(i - 1) + part)
            ix, iy, iz, fx, fy, fz = stand(
                at_i, ox, oy, oz, sx, sy, sz, top_x, top_y, top_z
            )
            cell = (iz >> shift) * cells_y + (iy >> shift)
            cell = select(on, cell * cells_x + (ix >> shift), 0)
            corner = gather(view.corners, cell, on)
            missing = on & (corner == ABSENT)
            at = on & ~missing
            if clock > 0:
                stamp(view.slots, cell, at, marks, view.stamp, clock)
            corner = select(at, corner + (iz * n2 + iy * n1 + ix), 0)
            v, gx, gy, gz = cell4(view.samples, corner, step, deep, fx, fy, fz)
            steep = sqrt(gx * gx + gy * gy + gz * gz)
            sloped = steep > ZERO
            rise = gx * (sx * spacing[0]) + gy * (sy * spacing[1])
            rise += gz * (sz * spacing[2])
            inner = (rise > ZERO) & (i > 0)
            back = select(inner, minimum(v / rise, LAST_PART), ZERO)
            depths = as_i32(near + (at_i - back) * h)
            last = gather(ends, ray, at)
            put_rows4(
                cursor, ray, select(at, last, i), select(at, DONE, stage),
                select(at, depths, bracket), select(missing, cell + 1, 0),
            )  # fmt: skip
            put_rows4(
                value, ray, select(at, select(sloped, -gx / steep, gx), ZERO),
                select(at, select(sloped, -gy / steep, gy), ZERO),
                select(at, select(sloped, -gz / steep, gz), ZERO),
                select(at, ONE, zero),
            )  # fmt: skip
            counters[0] += count(at)
            counters[1] += count(at)

        for k in order:
            if cursor[k, 1] == DONE:
                depth[k] = cursor[k, 2:3].view(np.float32)[0]

    return settle_scope
