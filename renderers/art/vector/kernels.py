"""March packets of rays: the steps of `renderers.art.kernels`, many rays at a time.

Every lane holds a ray. Lanes in empty space leap until most lanes stand where there may
be something; those sample, classify, shade and composite together. Each ray sees the
operations of the scalar march in their order, whatever its neighbours do: neither the
width nor the order of rays changes a bit. A packet goes on until its last ray has
ended. Lanes are not refilled before: rays side by side end at about the same time and
share what they read, and with refills a picture took 1.09 to 1.24 times as long.
Distances over empty space are read voxel by voxel for the whole volume, so that rays
leap through missing cells and stop only where they need one. The distance at the next
sample is asked for while this one is worked on: a round of leaps waits for memory most
of its time, a round of samples computes most of it.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.art.kernels import SLOWEST, WITHIN
from renderers.art.optics.kernels import HALF, ONE, ZERO
from renderers.art.vector.lookup.kernels import between_nodes, place_of
from renderers.art.vector.optics.kernels import opacity
from renderers.art.vector.shading.kernels import light_up
from renderers.art.views import ABSENT, CellView, Classification
from renderers.simd import (
    absolute,
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
"""A vector of `renderers.simd`."""

F32 = NDArray[np.float32]
I32 = NDArray[np.int32]

FAR = np.float32(np.inf)


@njit(cache=True, nogil=True, error_model="numpy")
def queue_rays(
    order: I32, ends: I32, cursor: I32, spare: np.int32, queue: I32
) -> tuple[int, bool]:
    """List the unfinished rays in their order; give their number.

    spare: filled in behind them. queue: int32, longer than `order` by a packet. Tell as
    well whether any of them has moved before.
    """
    found, farthest = 0, 0
    for ray in order:
        cursor[ray, 3] = 0
        at, end = cursor[ray, 0], ends[ray]
        # No branch: at the rim of what is seen none could be foretold.
        queue[found] = ray
        found += at < end
        farthest = max(farthest, at if at < end else 0)
    queue[found:] = spare
    return found, farthest > 0


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def per_voxel(s: Lanes) -> Lanes:
    """Turn voxels per sample into samples per voxel, finite also across the axis."""
    return ONE / select(s >= ZERO, maximum(s, SLOWEST), minimum(s, -SLOWEST))


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def way_out(f: Lanes, p: Lanes, reach: Lanes) -> Lanes:
    """Count samples along one axis out of the empty cubes around.

    f: how far into its cube a sample is. p: samples per voxel. reach: from the middle
    of the cube to where leaps along the axis end.
    """
    return (HALF - f) * p + reach * absolute(p)


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


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def cube_at(
    fi: Lanes, ox: Lanes, oy: Lanes, oz: Lanes, sx: Lanes, sy: Lanes, sz: Lanes,
    top_x: np.int32, top_y: np.int32, top_z: np.int32, row: np.int32, slab: np.int32,
) -> Lanes:  # fmt: skip
    """Number the cubes that samples `fi` of rays lie in."""
    ix = minimum(i32(ox + fi * sx), top_x)
    iy = minimum(i32(oy + fi * sy), top_y)
    iz = minimum(i32(oz + fi * sz), top_z)
    return iz * slab + iy * row + ix


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

        Arguments as the scalar march has them.
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
        queue = np.empty(len(order) + width, np.int32)
        marks = np.empty(width, np.int32)
        depths = np.empty(width, np.float32)
        spare = np.int32(len(value) - 1)
        zero = full(ZERO, width)
        none = full(np.int32(0), width)
        skipped, samples, contributing = none, 0, 0
        total, moved = queue_rays(order, ends, cursor, spare, queue)
        for head in range(0, total, width):
            ray = load(queue, head, width)
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
            cube = cube_at(
                f32(i), ox, oy, oz, sx, sy, sz, top_x, top_y, top_z, row, slab
            )
            far = gather_u8(view.leap, select(on, cube, 0), on)
            while any_(on):
                fi = f32(i)
                x, y, z = ox + fi * sx, oy + fi * sy, oz + fi * sz
                ix = minimum(i32(x), top_x)
                iy = minimum(i32(y), top_y)
                iz = minimum(i32(z), top_z)
                fx, fy, fz = x - f32(ix), y - f32(iy), z - f32(iz)
                leaps = on & (far > 0)
                at = on & ~leaps
                if any_(leaps):
                    reach = f32(far) - WITHIN
                    out = way_out(fx, px, reach)
                    out = minimum(out, way_out(fy, py, reach))
                    out = minimum(out, way_out(fz, pz, reach))
                    out = minimum(maximum(out, ZERO), f32(end - i - 1))
                    jump = i32(out) + 1
                    jump = select(leaps, jump, 0)
                    skipped += jump
                    i += jump
                if count(leaps) > patience or not any_(at):
                    on = i < end
                    cube = cube_at(
                        f32(i), ox, oy, oz, sx, sy, sz, top_x, top_y, top_z, row,
                        slab,
                    )  # fmt: skip
                    far = gather_u8(view.leap, select(on, cube, 0), on)
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
                i = select(at, i + 1, i)
                # Ask how far it is to the next before anything hangs on this one.
                on = i < end
                cube = cube_at(
                    f32(i), ox, oy, oz, sx, sy, sz, top_x, top_y, top_z, row, slab
                )
                far = gather_u8(view.leap, select(on, cube, 0), on)
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
                    cr, cg, cb = light_up(
                        lights, material, least_gradient, zero, cr, cg, cb,
                        gx, gy, gz,
                        x * spacing[0], y * spacing[1], z * spacing[2],
                        vx, vy, vz,
                    )  # fmt: skip
                weight = t * opacity(kappa * h)
                r, lr = add(r, lr, weight * cr, seen)
                g, lg = add(g, lg, weight * cg, seen)
                b, lb = add(b, lb, weight * cb, seen)
                a, la = add(a, la, weight, seen)
                t = maximum((ONE - a) - la, ZERO)
                half = select(seen & (t <= HALF) & (half == 0), i, half)
                end = select(seen & (t < cutoff), 0, end)
                on &= i < end
            stays = wait > 0
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
                        depth[queue[head + lane]] = depths[lane]
        counters[0] += samples
        counters[1] += contributing
        store(marks, 0, skipped)
        for lane in range(width):
            counters[2] += marks[lane]

    return march_classic
