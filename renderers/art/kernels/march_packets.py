"""March packets of rays through cells: sample, classify, shade, composite.

Positions inside the loops are float32 voxel coordinates, counted from the ray's first
sample inside the volume, so that a camera a kilometre away costs no accuracy. Sample
``i`` of a ray lies at ``origin + i * step`` whatever was skipped before it and
whichever cell it falls into: that is why neither cell size, nor threads, nor the order
in which cells arrive can change a bit. A ray that meets a missing cell writes down
where it stopped and goes on later from there.

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

Post-classified, the opacity of a step of length h is ``1 - exp(-kappa h)``. Integrated,
sample ``i`` ends segment ``i``, which the sample before began; a ray takes the value
and the gradient of its last sample along (`front`), so that it needs one cell at a time
wherever it stops. A segment between two empty ends contributes nothing, since one
interval of densities makes all empty space there is (see `ClassicMarch`). Hence rays
leap as others do, and where they meet something they take the sample before it, the
last empty one, as well; and the first empty one behind it. Across the face of a cut
densities go in no straight line: each half of such a segment has what its own end has.

What a sum rounds away is added with the next term (Kahan, CACM 1965;8:40), so that a
million thin steps add up.
"""

from collections.abc import Callable

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.art.kernels.classify import classify
from renderers.art.kernels.deflect_samples import (
    INTEGRATED,
    POST,
    deflected_samples,
    place,
    turn,
)
from renderers.art.kernels.march_types import (
    F32,
    I32,
    CellView,
    Deflectors,
    Lanes,
    Line,
    RayArrays,
    ShadeSettings,
    Three,
)
from renderers.art.kernels.opacity import HALF, ONE, ZERO, opacity
from renderers.art.kernels.segments import end_of, integrate
from renderers.art.kernels.shade_samples import any_local, are_grey, light_up
from renderers.art.kernels.skip import find_corners, leap, per_voxel, rows_of
from renderers.simd import (
    any_,
    cell1,
    cell4,
    count,
    f32,
    full,
    gather,
    gather_u8,
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

ABREAST = 16
"""Rays looked at together to see whether they are unfinished."""

Four = tuple[Lanes, Lanes, Lanes, Lanes]


@njit(cache=True, nogil=True, error_model="numpy")
def queue_rays(
    order: I32, ends: I32, cursor: I32, spare: np.int32, queue: I32
) -> tuple[int, bool]:
    """List the unfinished rays in their order; return their number.

    spare: filled in behind them. queue: int32, twice as long as `order` and a packet
    more: of a packet less than half the rays come again. Also return whether any of
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
    """Return sums with a term more where on, and what they have rounded away by now."""
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


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def store_sums(
    value: F32, carry: F32, ray: Lanes, sums: Four, lost: Four, t: Lanes, stays: Lanes,
    cut: Lanes, moved: bool,
) -> None:  # fmt: skip
    """Write down what a packet's rays have gathered: some stay, the others have ended.

    t: transmittance. cut: for whom sums are divided by their opacity. moved: some have
    been written before, so that what they had lost must be put right.
    """
    r, g, b, a = sums
    lr, lg, lb, la = lost
    if any_(cut):
        k = ONE / (ONE - t)
        r, g = select(cut, (r + lr) * k, r), select(cut, (g + lg) * k, g)
        b, a = select(cut, (b + lb) * k, b), select(cut, ONE, a)
        lr, lg = select(cut, ZERO, lr), select(cut, ZERO, lg)
        lb, la = select(cut, ZERO, lb), select(cut, ZERO, la)
    put_rows4(
        value, ray, select(stays, r, r + lr), select(stays, g, g + lg),
        select(stays, b, b + lb), select(stays, a, a + la),
    )  # fmt: skip
    if moved or any_(stays):
        put_rows4(
            carry, ray, select(stays, lr, ZERO), select(stays, lg, ZERO),
            select(stays, lb, ZERO), select(stays, la, ZERO),
        )  # fmt: skip


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def store_depths(
    depth: F32, queue: I32, head: int, width: int, half: Lanes, depths: Lanes,
    marks: I32, found: F32,
) -> None:  # fmt: skip
    """Write the depths of the rays whose opacity has passed one half.

    head: of the packet in the queue. marks, found: of the packet's size, scratch.
    """
    if any_(half > 0):
        store(marks, 0, half)
        store(found, 0, depths)
        for lane in range(width):
            if marks[lane] > 0:
                depth[queue[head + lane]] = found[lane]


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def light_samples(
    lights: F32, grey: bool, local: bool, material: F32, least_gradient: np.float32,
    spacing: F32, one: Lanes, color: Three, gradient: Three, at: tuple[Lanes, Lanes],
    line: Line, way: Three,
) -> Three:  # fmt: skip
    """Return colours of samples under lights; see `light_up`.

    at: numbers of samples, and how far before them, in steps, the light falls.
    """
    place = color
    if local:
        ox, oy, oz, sx, sy, sz = line
        i, back = at
        place = (
            ((ox + i * sx) - back * sx) * spacing[0],
            ((oy + i * sy) - back * sy) * spacing[1],
            ((oz + i * sz) - back * sz) * spacing[2],
        )
    return light_up(
        lights, grey, material, least_gradient, one, color, gradient, place, way
    )


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def mix_halves(
    parted: Lanes, first: Lanes, rest: Lanes, before: Three, after: Three, color: Three
) -> Three:
    """Return colours of segments, of those that a cut parts made of two halves.

    first, rest: opacities of the halves. before, after: their colours. color: of whole
    segments.
    """
    share = first / (first + (ONE - first) * rest)
    both = rest > ZERO  # what was not looked at may have any colour
    r, g, b = color
    r0, g0, b0 = before
    r1, g1, b1 = after
    r1, g1, b1 = select(both, r1, r0), select(both, g1, g0), select(both, b1, b0)
    return (
        select(parted, share * r0 + (ONE - share) * r1, r),
        select(parted, share * g0 + (ONE - share) * g1, g),
        select(parted, share * b0 + (ONE - share) * b1, b),
    )


def march_packets(
    width: int, lit: bool, integrated: bool, deflected: bool
) -> Callable[..., None]:
    """Make the march of packets of `width` rays, a power of two from 4.

    lit: bricks have gradients, and samples are shaded; else they hold values alone.
    integrated: samples end segments, which are integrated; else they are classified,
    each for the middle of its step.
    """
    patience = 3 * width // 8
    kind = INTEGRATED if integrated else POST

    @njit(cache=True, nogil=True, error_model="numpy")
    def march(
        rays: RayArrays, view: CellView, shift: int, clock: int, shade: ShadeSettings,
        deflectors: Deflectors, counters: NDArray[np.int64],
    ) -> None:  # fmt: skip
        """Composite each ray until it ends, is opaque, or misses a cell.

        clock: stamped on cells that are used; none when it is 0. counters: int64
        samples, contributing, skipped, deflected. Segments are shaded in their middles
        with the mean of the gradients at their ends; the depth is then the middle of
        the one in which opacity passes one half.
        """
        # Numba counts references to arrays that are taken from tuples: take them here.
        order, geometry, ends, cursor, value, carry, depth, front = rays
        lines, low, scale, most, first, extinction, color, slope = shade.table
        _, sums, lights, material, spacing, least_gradient, cutoff, renormalise = shade
        empty, corners, slots, used = view.leap, view.corners, view.slots, view.stamp
        whole = not lit and len(view.whole) > 0
        field, unit = view.whole if whole else view.samples, view.unit
        top, bins = (view.top[0], view.top[1], view.top[2]), (low, scale, most)
        n1, n2, row, slab = rows_of(view.top, shift, whole)
        grid, wide, deep = (
            (shift, view.counts[0], view.counts[1], n1, n2),
            int(n1),
            int(n2),
        )
        places = deflected_samples(
            deflectors, kind, geometry, spacing, view, width if deflected else 0
        )
        queue = np.empty(2 * len(order) + width, np.int32)
        marks, depths = np.empty(width, np.int32), np.empty(width, np.float32)
        spare, head = np.int32(len(value) - 1), 0
        zero, one, none = full(ZERO, width), full(ONE, width), full(np.int32(0), width)
        grey, local = are_grey(lights), any_local(lights)
        skipped, samples, contributing = none, 0, 0
        total, moved = queue_rays(order, ends, cursor, spare, queue)
        while head < total:
            ray = load(queue, head, width)
            head += width
            few = patience if head < total else 0
            ox, oy, oz, sx, sy, sz, h, near = rows8(geometry, ray)
            line, per = (ox, oy, oz, sx, sy, sz), per_voxel(sx, sy, sz)
            r, g, b, a, lr, lg, lb, la = zero, zero, zero, zero, zero, zero, zero, zero
            i, half, joint = none, none, none
            if moved:
                r, g, b, a = rows4(value, ray)
                lr, lg, lb, la = rows4(carry, ray)
                i, half, joint, _ = rows4(cursor, ray)
            # The last sample begins segment `joint` and is empty unless `within`.
            within, wait, forced, v0 = none, none, none, zero
            gx0, gy0, gz0 = zero, zero, zero
            if integrated:
                if moved:
                    joint, within = joint >> 1, joint & 1
                    v0, gx0, gy0, gz0 = rows4(front, ray)
                p0, k0, r0, g0, b0 = end_of(
                    lines, first, extinction, color, slope, bins, v0, none == 0
                )
            if deflected:
                store(places.ray, 0, ray)
            m = ONE / h
            way = sx * spacing[0] * m, sy * spacing[1] * m, sz * spacing[2] * m
            last = gather(ends, ray, ray < spare)
            end, on, t = last, i < last, maximum((ONE - a) - la, ZERO)
            ix, iy, iz, fx, fy, fz = place(
                deflected, width, f32(i), on, line, top, places
            )
            far = gather_u8(empty, iz * slab + iy * row + ix, on)
            while count(on) > few:
                leaps, parted = on & (far > 0), none > 0
                if deflected:
                    parted = on & (load(places.parted, 0, width) > 0) & (forced == 0)
                if integrated:
                    # Where something begins, the empty sample before is needed, too.
                    back = on & (far == 0) & (joint != i) & (i > 0) & (forced == 0)
                    back &= ~parted
                    if any_(back):
                        step_back = select(back, none + 1, none)
                        i, skipped = i - step_back, skipped - step_back
                        forced += step_back
                        ix, iy, iz, fx, fy, fz = place(
                            deflected, width, f32(i), back, line, top, places
                        )
                    leaps &= ~((joint == i) & (within > 0))
                at = on & ~leaps
                if any_(leaps):
                    if deflected:
                        jump = minimum(load(places.jump, 0, width), end - i)
                        jump = select(leaps, jump, none)
                    else:
                        jump = leap(leaps, far, fx, fy, fz, per, end - i)
                    i, skipped = i + jump, skipped + jump
                if count(leaps) > patience or not any_(at):
                    on = i < end
                    ix, iy, iz, fx, fy, fz = place(
                        deflected, width, f32(i), on & leaps, line, top, places
                    )
                    far = gather_u8(empty, iz * slab + iy * row + ix, on)
                    if integrated:
                        far = select(forced > 0, 0, far)
                    continue
                moves = at
                if integrated and deflected:
                    # What lies beyond the face of a cut is not looked at.
                    at &= ~(parted & (far > 0))
                cell, corner, missing = find_corners(
                    corners, grid, whole, ix, iy, iz, at
                )
                if not whole:
                    if any_(missing):
                        wait = select(missing, cell + 1, wait)
                        end = select(missing, 0, end)
                        at, moves = at & ~missing, moves & ~missing
                    if clock > 0:
                        stamp(slots, cell, at, marks, used, clock)
                corner = select(at, corner, 0)
                fy = minimum(maximum(fy, ZERO), ONE)
                if integrated:
                    # The last sample lies on the volume's face, and rounding beyond it.
                    fx = minimum(maximum(fx, ZERO), ONE)
                    fz = minimum(maximum(fz, ZERO), ONE)
                gx, gy, gz = zero, zero, zero
                if lit:
                    v, gx, gy, gz = cell4(view.samples, corner, wide, deep, fx, fy, fz)
                    gx, gy, gz = turn(deflected, width, gx, gy, gz, at, none, places)
                else:
                    v = cell1(field, corner, wide, deep, fx, fy, fz)
                samples += count(at)
                joined, here = moves & (joint == i) & (i > 0), f32(i)
                i = select(moves, i + 1, i)
                if integrated:
                    joint = select(at, i, select(moves, 0, joint))
                    inside = at & (far == 0) & (forced == 0)
                    within = select(inside, none + 1, select(moves, 0, within))
                    forced = select(at, 0, forced)
                tissue, rest = h, h
                if deflected:
                    tissue = load(places.tissue, 0, width)
                    rest = load(places.tissue, width, width)
                # Ask how far it is to the next before anything hangs on this one.
                on = i < end
                ix, iy, iz, fx, fy, fz = place(
                    deflected, width, f32(i), on, line, top, places
                )
                far = gather_u8(empty, iz * slab + iy * row + ix, on)
                v *= unit
                if integrated:
                    p1, k1, r1, g1, b1 = end_of(
                        lines, first, extinction, color, slope, bins, v, at
                    )
                    alpha, cr, cg, cb = integrate(
                        extinction, color, sums, h, joined, v0, (p0, k0, r0, g0, b0), v,
                        (p1, k1, r1, g1, b1), zero,
                    )  # fmt: skip
                    if deflected:
                        tissue = select(joined, opacity(k0 * (tissue * h)), ZERO)
                        rest = select(at, opacity(k1 * (rest * h)), ZERO)
                        both = tissue + (ONE - tissue) * rest
                        alpha = select(parted, both, alpha)
                        joined |= moves & parted
                    seen = joined & (alpha > ZERO)
                else:
                    kappa, cr, cg, cb, _, _ = classify(
                        lines, first, extinction, color, slope, bins, v, at
                    )
                    if deflected:
                        kappa *= tissue + rest
                    seen = at & (kappa > ZERO)
                found = count(seen)
                if integrated:
                    light, new = (r0, g0, b0), (r1, g1, b1)
                    if lit and found > 0:
                        mx, my, mz = (
                            HALF * (gx0 + gx),
                            HALF * (gy0 + gy),
                            HALF * (gz0 + gz),
                        )
                        cr, cg, cb = light_samples(
                            lights, grey, local, material, least_gradient, spacing, one,
                            (cr, cg, cb), (mx, my, mz), (here, one * HALF), line, way,
                        )  # fmt: skip
                        if deflected:
                            light = light_samples(
                                lights, grey, local, material, least_gradient, spacing,
                                one, light, (gx0, gy0, gz0), (here, zero), line, way,
                            )  # fmt: skip
                            new = light_samples(
                                lights, grey, local, material, least_gradient, spacing,
                                one, new, (gx, gy, gz), (here, zero), line, way,
                            )  # fmt: skip
                    if deflected:
                        cr, cg, cb = mix_halves(
                            parted, tissue, rest, light, new, (cr, cg, cb)
                        )
                    v0, p0, k0 = (
                        select(at, v, v0),
                        select(at, p1, p0),
                        select(at, k1, k0),
                    )
                    r0, g0 = select(at, r1, r0), select(at, g1, g0)
                    b0 = select(at, b1, b0)
                    if lit:
                        gx0, gy0 = select(at, gx, gx0), select(at, gy, gy0)
                        gz0 = select(at, gz, gz0)
                if found == 0:
                    continue
                contributing += found
                if not integrated:
                    alpha = opacity(kappa * h)
                    if lit:
                        cr, cg, cb = light_samples(
                            lights, grey, local, material, least_gradient, spacing, one,
                            (cr, cg, cb), (gx, gy, gz), (here, zero), line, way,
                        )  # fmt: skip
                weight = t * alpha
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
            if integrated:
                joint += joint + within
                if moved or any_(stays):
                    put_rows4(front, ray, v0, gx0, gy0, gz0)
            put_rows4(cursor, ray, select(stays, i, last), half, joint, wait)
            cut = ~stays & (t < cutoff) if renormalise else none > 0
            store_sums(
                value, carry, ray, (r, g, b, a), (lr, lg, lb, la), t, stays, cut, moved
            )
            middle = f32(half - 1) - HALF if integrated else f32(half - 1)
            store_depths(
                depth,
                queue,
                head - width,
                width,
                half,
                near + middle * h,
                marks,
                depths,
            )
        counters[0] += samples
        counters[1] += contributing
        store(marks, 0, skipped)
        for lane in range(width):
            counters[2] += marks[lane]
        counters[3] += places.found[0]

    return march
