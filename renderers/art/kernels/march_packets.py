"""March packets of rays through cells; sample, classify, shade, composite.

Positions inside the loops are float32 voxel coordinates, counted from the ray's first
sample inside the volume, so that a camera a kilometre away costs no accuracy. Sample
``i`` of a ray lies at ``origin + i * step`` whatever was skipped before it and
whichever cell it falls into: that is why neither cell size, nor threads, nor the order
in which cells arrive can change a bit. A ray that meets a missing cell writes down
where it stopped and goes on later from there.

Ray arrays, one row per ray: ``order`` int32 rays to march, neighbours after each other;
``geometry`` float32 (origin x y z, step x y z in voxels, step in mm, distance of sample
0 in mm); ``count`` int32 samples; ``cursor`` int32 (sample, stage, bracket, cell waited
for + 1 or 0), stage in mode `classic` the sample at which opacity passed one half, + 1,
or 0; ``value`` float32 (r, g, b, alpha) or (normal, coverage); ``carry`` float32, what
adding to ``value`` has rounded away so far; ``depth`` float32 mm. cursor, value and
carry end with a spare row.

Every lane holds a ray. Lanes in empty space leap until most lanes stand where there may
be something; those sample, classify, shade and composite together. Each ray sees the
same operations in the same order, whatever its neighbours do: neither the width nor the
order of rays changes a bit. Rays that outlive most of their packet are written down,
and when all packets have gone march on in packets of their own: fresh rays in their
place would leap while the others sample (up to 1.2 times the time of waiting for the
last ray; going on later takes .85 to 1.02 of it). Distances over empty space are read
voxel by voxel for the whole volume, so that rays leap through missing cells and stop
only where they need one. The distance at the next sample is asked for while this one is
worked on: a round of leaps waits for memory most of its time, a round of samples
computes most of it.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.art.cells.brick_views import ABSENT, CellView, Classification
from renderers.art.kernels.classify import between_nodes, place_of
from renderers.art.kernels.opacity import HALF, ONE, ZERO, opacity
from renderers.art.kernels.shade_samples import any_local, are_grey, light_up
from renderers.art.kernels.skip import leap, per_voxel, stand
from renderers.lanes import (
    any_,
    cell1,
    cell4,
    count,
    f32,
    full,
    gather,
    gather_u8,
    i32,
    load,
    maximum,
    minimum,
    put_rows4,
    rows4,
    rows8,
    select,
    store,
    store_packed,
)

Lanes = Any
"""A vector of `renderers.lanes`."""

F32 = NDArray[np.float32]
I32 = NDArray[np.int32]

FAR = np.float32(np.inf)

ABREAST = 16
"""Rays looked at together to see whether they are unfinished."""


@njit(cache=True, nogil=True, error_model="numpy")
def queue_rays(
    order: I32, ends: I32, cursor: I32, spare: np.int32, queue: I32
) -> tuple[int, bool]:
    """List the unfinished rays in their order; give their number.

    spare: filled in behind them. queue: int32, twice as long as `order` and a packet
    more: of a packet less than half the rays come again. Tell as well whether any of
    them has moved before.
    """
    found, moved = 0, False
    packets = len(order) // ABREAST * ABREAST
    for head in range(0, packets, ABREAST):
        rays = load(order, head, ABREAST)
        every = rays >= 0
        at = gather(cursor, 4 * rays, every)
        unfinished = at < gather(ends, rays, every)
        store_packed(queue, found, rays, unfinished)
        found += count(unfinished)
        moved |= any_(unfinished & (at > 0))
    for ray in order[packets:]:
        queue[found] = ray
        if cursor[ray, 0] < ends[ray]:
            found += 1
            moved |= cursor[ray, 0] > 0
    queue[found:] = spare
    return found, moved


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def add(total: Lanes, lost: Lanes, term: Lanes, on: Lanes) -> tuple[Lanes, Lanes]:
    """Give sums with a term more where on, and what they have rounded away by now."""
    part = select(on, term, ZERO) + lost
    more = select(on, total + part, total)
    return more, part - (more - total)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def stamp(
    slots: I32, cell: Lanes, at: Lanes, marks: I32, used: NDArray[np.int64], clock: int
) -> None:
    """Write the time on the slots of the cells that lanes stand in."""
    store_packed(marks, 0, gather(slots, cell, at), at)
    for k in range(count(at)):
        used[marks[k]] = clock


def classic_packets(width: int, lit: bool) -> Callable[..., None]:
    """Make `march_classic` for packets of `width` rays, a power of two from 4.

    lit: bricks have gradients, and samples are shaded; else they hold values alone.
    """
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

        lights: float32 (m, 10) vector in mm along the array's axes, diffuse and
        specular colour, is local. material: float32 (3,) ambient, specular, shininess.
        counters: int64 samples, contributing, skipped. clock: stamped on cells that are
        used; none when it is 0. Post-classified; the opacity of a step of length h is
        ``1 - exp(-kappa h)``. What a sum rounds away is added with the next term
        (Kahan, CACM 1965;8:40), so that a million thin steps add up.
        """
        whole = not lit and len(view.whole) > 0
        n1 = np.int32((1 << shift) + 1)
        n2 = n1 * n1
        if whole:
            n1, n2 = view.top[0] + np.int32(2), view.top[1] + np.int32(2)
            n2 *= n1
        step, deep = np.int64(n1), np.int64(n2)
        field = view.whole if whole else view.samples
        top_x, top_y, top_z = view.top[0], view.top[1], view.top[2]
        row, slab = top_x + np.int32(1), (top_x + np.int32(1)) * (top_y + np.int32(1))
        cells_x, cells_y = view.counts[0], view.counts[1]
        queue = np.empty(2 * len(order) + width, np.int32)
        marks = np.empty(width, np.int32)
        depths = np.empty(width, np.float32)
        spare = np.int32(len(value) - 1)
        zero, one = full(ZERO, width), full(ONE, width)
        grey, local = are_grey(lights), any_local(lights)
        none = full(np.int32(0), width)
        skipped, samples, contributing = none, 0, 0
        total, moved = queue_rays(order, ends, cursor, spare, queue)
        head = 0
        while head < total:
            ray = load(queue, head, width)
            head += width
            few = patience if head < total else 0
            ox, oy, oz, sx, sy, sz, h, near = rows8(geometry, ray)
            px, py, pz = per_voxel(sx), per_voxel(sy), per_voxel(sz)
            r, g, b, a = zero, zero, zero, zero
            lr, lg, lb, la = zero, zero, zero, zero
            vx, vy, vz = zero, zero, zero
            i, half, wait = none, none, none
            if moved:
                r, g, b, a = rows4(value, ray)
                lr, lg, lb, la = rows4(carry, ray)
                i, half, _, _ = rows4(cursor, ray)
            if lit:
                per_mm = ONE / h
                vx, vy = sx * spacing[0] * per_mm, sy * spacing[1] * per_mm
                vz = sz * spacing[2] * per_mm
            last = gather(ends, ray, ray < spare)
            end = last
            t = maximum((ONE - a) - la, ZERO)
            on = i < end
            ix, iy, iz, fx, fy, fz = stand(
                f32(i), ox, oy, oz, sx, sy, sz, top_x, top_y, top_z
            )
            far = gather_u8(view.leap, iz * slab + iy * row + ix, on)
            while count(on) > few:
                leaps = on & (far > 0)
                at = on & ~leaps
                if any_(leaps):
                    jump = leap(leaps, far, fx, fy, fz, px, py, pz, end - i)
                    skipped += jump
                    i += jump
                if count(leaps) > patience or not any_(at):
                    on = i < end
                    ix, iy, iz, fx, fy, fz = stand(
                        f32(i), ox, oy, oz, sx, sy, sz, top_x, top_y, top_z
                    )
                    far = gather_u8(view.leap, iz * slab + iy * row + ix, on)
                    continue
                corner = iz * n2 + iy * n1 + ix
                if not whole:
                    cell = (iz >> shift) * cells_y + (iy >> shift)
                    cell = select(at, cell * cells_x + (ix >> shift), 0)
                    first = gather(view.corners, cell, at)
                    missing = at & (first == ABSENT)
                    if any_(missing):
                        wait = select(missing, cell + 1, wait)
                        end = select(missing, 0, end)
                        at &= ~missing
                    if clock > 0:
                        stamp(view.slots, cell, at, marks, view.stamp, clock)
                    corner += first
                corner = select(at, corner, 0)
                fy = minimum(maximum(fy, ZERO), ONE)
                gx, gy, gz = zero, zero, zero
                if lit:
                    v, gx, gy, gz = cell4(view.samples, corner, step, deep, fx, fy, fz)
                else:
                    v = cell1(field, corner, step, deep, fx, fy, fz)
                samples += count(at)
                here = i
                i = select(at, i + 1, i)
                # Ask how far it is to the next before anything hangs on this one.
                on = i < end
                ix, iy, iz, fx, fy, fz = stand(
                    f32(i), ox, oy, oz, sx, sy, sz, top_x, top_y, top_z
                )
                far = gather_u8(view.leap, iz * slab + iy * row + ix, on)
                v *= view.unit
                place = place_of(v, table.low, table.scale, table.last)
                bin_ = i32(place)
                f = place - f32(bin_)
                kappa, dk, cr, dr, cg, dg, cb, db = rows8(table.lines, bin_)
                kappa, cr = kappa + f * dk, cr + f * dr
                cg, cb = cg + f * dg, cb + f * db
                mixed = at & (kappa < ZERO)
                if any_(mixed):
                    kappa, cr, cg, cb = between_nodes(
                        table.first, table.extinction, table.color,
                        table.color_slope, bin_, v, mixed, kappa, cr, cg, cb,
                    )  # fmt: skip
                seen = at & (kappa > ZERO)
                found = count(seen)
                if found == 0:
                    continue
                contributing += found
                if lit:
                    x, y, z = zero, zero, zero
                    if local:
                        fi = f32(here)
                        x = (ox + fi * sx) * spacing[0]
                        y = (oy + fi * sy) * spacing[1]
                        z = (oz + fi * sz) * spacing[2]
                    cr, cg, cb = light_up(
                        lights, grey, material, least_gradient, one, cr, cg, cb,
                        gx, gy, gz, x, y, z, vx, vy, vz,
                    )  # fmt: skip
                weight = t * opacity(kappa * h)
                r, lr = add(r, lr, weight * cr, seen)
                g, lg = add(g, lg, weight * cg, seen)
                b, lb = add(b, lb, weight * cb, seen)
                a, la = add(a, la, weight, seen)
                t = maximum((ONE - a) - la, ZERO)
                half = select(seen & (t <= HALF) & (half == 0), i, half)
                ends_here = seen & (t < cutoff)
                end = select(ends_here, 0, end)
                on &= ~ends_here
            if any_(on):
                store_packed(queue, total, ray, on)
                total += count(on)
                moved = True
            stays = on | (wait > 0)
            if renormalise:
                cut = ~stays & (t < cutoff)
                k_ = ONE / (ONE - t)
                r = select(cut, (r + lr) * k_, r)
                g = select(cut, (g + lg) * k_, g)
                b, a = select(cut, (b + lb) * k_, b), select(cut, ONE, a)
                lr, lg = select(cut, ZERO, lr), select(cut, ZERO, lg)
                lb, la = select(cut, ZERO, lb), select(cut, ZERO, la)
            put_rows4(cursor, ray, select(stays, i, last), half, none, wait)
            put_rows4(
                value, ray, select(stays, r, r + lr), select(stays, g, g + lg),
                select(stays, b, b + lb), select(stays, a, a + la),
            )  # fmt: skip
            # What is once written must be put right when its ray has ended.
            if moved or any_(stays):
                put_rows4(
                    carry, ray, select(stays, lr, ZERO), select(stays, lg, ZERO),
                    select(stays, lb, ZERO), select(stays, la, ZERO),
                )  # fmt: skip
            if any_(half > 0):
                store(marks, 0, half)
                store(depths, 0, near + f32(half - 1) * h)
                for lane in range(width):
                    if marks[lane] > 0:
                        depth[queue[head - width + lane]] = depths[lane]
        counters[0] += samples
        counters[1] += contributing
        store(marks, 0, skipped)
        for lane in range(width):
            counters[2] += marks[lane]

    return march_classic
