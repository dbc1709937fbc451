"""Find the air surface by packets of rays.

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

from renderers.art.kernels.deflect_samples import (
    SURFACE,
    deflected_samples,
    place,
    turn_into_normals,
)
from renderers.art.kernels.march_packets import queue_rays, stamp
from renderers.art.kernels.march_types import (
    F32,
    I32,
    CellView,
    Deflectors,
    RayArrays,
)
from renderers.art.kernels.opacity import BIAS, DIGITS, ONE, ZERO
from renderers.art.kernels.skip import find_corners, leap, per_voxel, rows_of
from renderers.simd import (
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

DEFLECTED_BISECTIONS = 12
"""Of a deflected ray, whose field is not straight: a fifth of a micrometre is left."""


@njit(cache=True, nogil=True, error_model="numpy")
def queue_hits(order: I32, ends: I32, cursor: I32, found_at: int, queue: I32) -> int:
    """List the rays that have their surface between two samples; return their number.

    found_at: their stage.
    """
    found = 0
    for ray in order:
        stops = cursor[ray, 3] == 0 and cursor[ray, 0] < ends[ray]
        if stops and cursor[ray, 1] == found_at:
            queue[found] = ray
            found += 1
    return found


def seek_packets(width: int, deflected: bool) -> Callable[..., None]:
    """Make the search for surfaces, for packets of `width` rays, a power of two from 4.

    Rays that have one between two samples are left to `settle_packets`.
    """
    patience = 3 * width // 8
    most = DEFLECTED_BISECTIONS if deflected else BISECTIONS

    @njit(cache=True, nogil=True, error_model="numpy")
    def seek_surface(
        rays: RayArrays, view: CellView, shift: int, clock: int, spacing: F32,
        deflectors: Deflectors, counters: NDArray[np.int64],
    ) -> None:  # fmt: skip
        """Bracket where each ray first meets density >= 0; as `march_packets`."""
        order, geometry, ends, cursor, value, _, _, _ = rays
        empty, corners, slots, used = view.leap, view.corners, view.slots, view.stamp
        whole = len(view.whole) > 0
        top = view.top[0], view.top[1], view.top[2]
        n1, n2, row, slab = rows_of(view.top, shift, whole)
        grid, wide, deep = (
            (shift, view.counts[0], view.counts[1], n1, n2),
            int(n1),
            int(n2),
        )
        places = deflected_samples(
            deflectors, SURFACE, geometry, spacing, view, width if deflected else 0
        )
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
            line, per = (ox, oy, oz, sx, sy, sz), per_voxel(sx, sy, sz)
            i, stage, bracket, _ = rows4(cursor, ray)
            if deflected:
                store(places.ray, 0, ray)
            last, wait = gather(ends, ray, ray < spare), none
            end = select(stage > most, 0, last)
            while count(i < end) > few:
                on = i < end
                seeking = stage == 0
                halves = minimum(stage, most)
                part = f32(2 * bracket + 1) * as_f32((BIAS - halves) << DIGITS)
                at_i = select(seeking | (i == 0), f32(i), f32(i - 1) + part)
                ix, iy, iz, fx, fy, fz = place(
                    deflected, width, at_i, on, line, top, places
                )
                far = gather_u8(empty, iz * slab + iy * row + ix, on)
                leaps = on & seeking & (far > 0)
                if deflected:
                    jump = minimum(load(places.jump, 0, width), end - i)
                    jump = select(leaps, jump, none)
                else:
                    jump = leap(leaps, far, fx, fy, fz, per, end - i)
                i += jump
                skipped += jump
                at = on & ~leaps
                if count(leaps) > patience or not any_(at):
                    continue
                held = at & (far == 0)
                cell, corner, missing = find_corners(
                    corners, grid, whole, ix, iy, iz, held
                )
                if whole:
                    read = cell1(
                        view.whole, select(held, corner, 0), wide, deep, fx, fy, fz
                    )
                else:
                    if any_(missing):
                        wait = select(missing, cell + 1, wait)
                        end = select(missing, 0, end)
                        held &= ~missing
                        at &= ~missing
                        if not any_(at):
                            continue
                    if clock > 0:
                        stamp(slots, cell, held, marks, used, clock)
                    read, _, _, _ = cell4(
                        view.samples, select(held, corner, 0), wide, deep, fx, fy, fz
                    )
                v = select(held, read, zero - ONE)
                if deflected:
                    v = minimum(v, load(places.opening, 0, width))
                samples += count(held)
                air = v < ZERO
                bracket = select(
                    at & ~seeking, 2 * bracket + select(air, 1, none), bracket
                )
                begins = at & seeking & ~air
                begun = select(i > 0, 1, none + np.int32(most + 1))
                bracket = select(begins, 0, bracket)
                i = select(at & seeking & air, i + 1, i)
                stage = select(begins, begun, select(at & ~seeking, stage + 1, stage))
                end = select(stage > most, 0, end)
            left = i < end
            if any_(left):
                store_packed(queue, total, ray, left)
                total += count(left)
            # Rays that have their surface say so; the others have left, or wait.
            stays = left | (wait > 0) | (stage > most)
            put_rows4(cursor, ray, select(stays, i, last), stage, bracket, wait)
        counters[0] += samples
        store(marks, 0, skipped)
        for lane in range(width):
            counters[2] += marks[lane]
        counters[3] += places.found[0]

    return seek_surface


def settle_packets(width: int, deflected: bool) -> Callable[..., None]:
    """Make what reads depths and normals where `seek_packets` found surfaces."""
    most = DEFLECTED_BISECTIONS if deflected else BISECTIONS
    last_part = np.float32(1 / (1 << most))
    # the stage of a ray that is done; its bracket holds the bits of its depth
    done = np.int32(most + 2)

    @njit(cache=True, nogil=True, error_model="numpy")
    def settle_surface(
        rays: RayArrays, view: CellView, shift: int, clock: int, spacing: F32,
        deflectors: Deflectors, counters: NDArray[np.int64],
    ) -> None:  # fmt: skip
        """Read value and gradient of rays at the far ends of their brackets."""
        order, geometry, ends, cursor, value, _, depth, _ = rays
        queue = np.empty(len(order), np.int32)
        total = queue_hits(order, ends, cursor, most + 1, queue)
        top = view.top[0], view.top[1], view.top[2]
        n1, n2, _, _ = rows_of(view.top, shift, False)
        grid, wide, deep = (
            (shift, view.counts[0], view.counts[1], n1, n2),
            int(n1),
            int(n2),
        )
        places = deflected_samples(
            deflectors, SURFACE, geometry, spacing, view, width if deflected else 0
        )
        marks, values = np.empty(width, np.int32), np.empty(width, np.float32)
        spare = np.int32(len(value) - 1)
        zero = full(ZERO, width)
        for head in range(0, total, width):
            at = lanes(width) + np.int32(head)
            on = at < np.int32(total)
            ray = select(on, gather(queue, select(on, at, 0), on), spare)
            ox, oy, oz, sx, sy, sz, h, near = rows8(geometry, ray)
            if deflected:
                store(places.ray, 0, ray)
            i, stage, bracket, _ = rows4(cursor, ray)
            part = f32(bracket + 1) * last_part
            at_i = select(i == 0, f32(i), f32(i - 1) + part)
            ix, iy, iz, fx, fy, fz = place(
                deflected, width, at_i, on, (ox, oy, oz, sx, sy, sz), top, places
            )
            cell, corner, missing = find_corners(
                view.corners, grid, False, ix, iy, iz, on
            )
            held = on & ~missing
            if clock > 0:
                stamp(view.slots, cell, held, marks, view.stamp, clock)
            corner = select(held, corner, 0)
            v, gx, gy, gz = cell4(view.samples, corner, wide, deep, fx, fy, fz)
            back = zero
            if deflected:
                store(values, 0, v)
                store(places.gradient, 0, gx)
                store(places.gradient, width, gy)
                store(places.gradient, 2 * width, gz)
                turn_into_normals(values, places)
                nx = load(places.gradient, 0, width)
                ny = load(places.gradient, width, width)
                nz = load(places.gradient, 2 * width, width)
            else:
                steep = sqrt(gx * gx + gy * gy + gz * gz)
                sloped = steep > ZERO
                rise = gx * (sx * spacing[0]) + gy * (sy * spacing[1])
                rise += gz * (sz * spacing[2])
                inner = (rise > ZERO) & (i > 0)
                back = select(inner, minimum(v / rise, last_part), ZERO)
                nx = select(sloped, -gx / steep, gx)
                ny = select(sloped, -gy / steep, gy)
                nz = select(sloped, -gz / steep, gz)
            depths = as_i32(near + (at_i - back) * h)
            last = gather(ends, ray, held)
            put_rows4(
                cursor, ray, select(held, last, i), select(held, done, stage),
                select(held, depths, bracket), select(missing, cell + 1, 0),
            )  # fmt: skip
            put_rows4(
                value, ray, select(held, nx, ZERO), select(held, ny, ZERO),
                select(held, nz, ZERO), select(held, ONE, zero),
            )  # fmt: skip
            counters[0] += count(held)
            counters[1] += count(held)
        counters[3] += places.found[0]

        for k in order:
            if cursor[k, 1] == done:
                depth[k] = cursor[k, 2:3].view(np.float32)[0]

    return settle_surface
