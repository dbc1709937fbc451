"""March packets of rays whose samples end segments: transfer functions integrated.

The rays' arrays, their packets and the ways to stop and go on are those of
`renderers.art.kernels.march_packets`. Sample ``i`` ends segment ``i``, which the sample
before began; a ray takes the value and the gradient of its last sample along (`front`),
so that it needs one cell at a time wherever it stops. A segment between two empty ends
contributes nothing, since one interval of densities makes all empty space there is (see
`IntegratedMarch`). Hence rays leap as others do, and where they meet something they
take the sample before it, the last empty one, as well; and the first empty one behind
it.
"""

from collections.abc import Callable

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.art.cells.brick_views import ABSENT, CellView, Classification
from renderers.art.kernels.march_packets import FAR, add, queue_rays, stamp
from renderers.art.kernels.opacity import HALF, ONE, ZERO, opacity
from renderers.art.kernels.segments import beyond_nodes, classify, tilt
from renderers.art.kernels.shade_samples import any_local, are_grey, light_up
from renderers.art.kernels.skip import leap, per_voxel, stand
from renderers.lanes import (
    absolute,
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

F32 = NDArray[np.float32]
I32 = NDArray[np.int32]


def integrated_packets(width: int, lit: bool) -> Callable[..., None]:
    """Make `march_integrated` for packets of `width` rays, a power of two from 4.

    lit: bricks have gradients, and samples are shaded; else they hold values alone.
    """
    patience = 3 * width // 8

    @njit(cache=True, nogil=True, error_model="numpy")
    def march_integrated(
        order: I32, geometry: F32, ends: I32, cursor: I32, value: F32, carry: F32,
        depth: F32, front: F32, sums: F32, view: CellView, shift: int, clock: int,
        table: Classification, lights: F32, material: F32, spacing: F32,
        least_gradient: np.float32, cutoff: np.float32, renormalise: bool,
        counters: NDArray[np.int64],
    ) -> None:  # fmt: skip
        """Composite each ray's segments until it ends, is opaque, or misses a cell.

        front: float32 (rays + 1, 4), value and gradient of the last sample.
        ``cursor[:, 2]``: the segment it begins, twice, and one more if it is not empty.
        sums: as `sums_at_nodes` gives them. Segments are shaded in their middles with
        the mean of the gradients at their ends. `depth` is the middle of the segment in
        which opacity passes one half. The rest is as `classic_packets` has it.
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
            ox, oy, oz, sx, sy, sz, h, _ = rows8(geometry, ray)
            px, py, pz = per_voxel(sx), per_voxel(sy), per_voxel(sz)
            r, g, b, a = zero, zero, zero, zero
            lr, lg, lb, la = zero, zero, zero, zero
            vx, vy, vz = zero, zero, zero
            i, half, wait = none, none, none
            # The last sample: value, gradient, piece between nodes, extinction, colour;
            # it begins segment `joint` and is empty unless it is `within`.
            v0, fgx, fgy, fgz = zero, zero, zero, zero
            joint, within, forced = none, none, none
            if moved:
                r, g, b, a = rows4(value, ray)
                lr, lg, lb, la = rows4(carry, ray)
                i, half, joint, _ = rows4(cursor, ray)
                joint, within = joint >> 1, joint & 1
                v0, fgx, fgy, fgz = rows4(front, ray)
            if lit:
                per_mm = ONE / h
                vx, vy = sx * spacing[0] * per_mm, sy * spacing[1] * per_mm
                vz = sz * spacing[2] * per_mm
            p0, e0, r0, g0, b0 = classify(
                table.lines, table.first, table.extinction, table.color,
                table.color_slope, table.low, table.scale, table.last, v0, none == 0,
            )  # fmt: skip
            end = gather(ends, ray, ray < spare)
            t = maximum((ONE - a) - la, ZERO)
            on = i < end
            ix, iy, iz, fx, fy, fz = stand(
                f32(i), ox, oy, oz, sx, sy, sz, top_x, top_y, top_z
            )
            far = gather_u8(view.leap, iz * slab + iy * row + ix, on)
            while count(on) > few:
                # Where something begins, the empty sample before it is needed, too.
                back = on & (far == 0) & (joint != i) & (i > 0) & (forced == 0)
                if any_(back):
                    step_back = select(back, none + 1, none)
                    i -= step_back
                    skipped -= step_back
                    forced += step_back
                    ix, iy, iz, fx, fy, fz = stand(
                        f32(i), ox, oy, oz, sx, sy, sz, top_x, top_y, top_z
                    )
                leaps = on & (far > 0) & ~((joint == i) & (within > 0))
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
                    far = select(forced > 0, 0, far)
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
                # The last sample lies on the volume's face, and rounding beyond it.
                fx = minimum(maximum(fx, ZERO), ONE)
                fy = minimum(maximum(fy, ZERO), ONE)
                fz = minimum(maximum(fz, ZERO), ONE)
                gx, gy, gz = zero, zero, zero
                if lit:
                    v, gx, gy, gz = cell4(view.samples, corner, step, deep, fx, fy, fz)
                else:
                    v = cell1(field, corner, step, deep, fx, fy, fz)
                samples += count(at)
                joined = at & (joint == i) & (i > 0)
                here = i
                i = select(at, i + 1, i)
                joint = select(at, i, joint)
                inside = at & (far == 0) & (forced == 0)
                within = select(inside, none + 1, select(at, 0, within))
                forced = select(at, 0, forced)
                # Ask how far it is to the next before anything hangs on this one.
                on = i < end
                ix, iy, iz, fx, fy, fz = stand(
                    f32(i), ox, oy, oz, sx, sy, sz, top_x, top_y, top_z
                )
                far = gather_u8(view.leap, iz * slab + iy * row + ix, on)
                v *= view.unit
                p1, e1, r1, g1, b1 = classify(
                    table.lines, table.first, table.extinction, table.color,
                    table.color_slope, table.low, table.scale, table.last, v, at,
                )  # fmt: skip
                crossing = joined & (p0 != p1)
                crosses = any_(crossing)
                near, scale, ke, kr, kg, kb = h, h, e1, r1, g1, b1
                if crosses:
                    # up to the first node on the way
                    node = select(crossing, select(p1 > p0, p0 + 1, p0), 0)
                    at_node, _, k_, _ = rows4(table.extinction, node)
                    r_, g_, b_, _ = rows4(table.color, node)
                    scale = h / absolute(v - v0)
                    near = select(crossing, absolute(at_node - v0) * scale, h)
                    ke, kr = select(crossing, k_, e1), select(crossing, r_, r1)
                    kg, kb = select(crossing, g_, g1), select(crossing, b_, b1)
                alpha, cr, cg, cb = zero, zero, zero, zero
                tau = near * (HALF * (e0 + ke))
                if any_(joined & (tau > ZERO)):
                    alpha = opacity(tau)
                    w = tilt(e0, ke, tau, alpha)
                    cr = HALF * (r0 + kr) + (kr - r0) * w
                    cg = HALF * (g0 + kg) + (kg - g0) * w
                    cb = HALF * (b0 + kb) + (kb - b0) * w
                if crosses:
                    alpha, cr, cg, cb = beyond_nodes(
                        table.extinction, table.color, sums, crossing, p0, p1, scale,
                        v, e1, r1, g1, b1, alpha, cr, cg, cb,
                    )  # fmt: skip
                mx, my, mz = HALF * (fgx + gx), HALF * (fgy + gy), HALF * (fgz + gz)
                v0, p0, e0 = select(at, v, v0), select(at, p1, p0), select(at, e1, e0)
                r0, g0 = select(at, r1, r0), select(at, g1, g0)
                b0 = select(at, b1, b0)
                if lit:
                    fgx, fgy = select(at, gx, fgx), select(at, gy, fgy)
                    fgz = select(at, gz, fgz)
                seen = joined & (alpha > ZERO)
                found = count(seen)
                if found == 0:
                    continue
                contributing += found
                if lit:
                    x, y, z = zero, zero, zero
                    if local:
                        fi = f32(here)
                        x = ((ox + fi * sx) - HALF * sx) * spacing[0]
                        y = ((oy + fi * sy) - HALF * sy) * spacing[1]
                        z = ((oz + fi * sz) - HALF * sz) * spacing[2]
                    cr, cg, cb = light_up(
                        lights, grey, material, least_gradient, one, cr, cg, cb,
                        mx, my, mz, x, y, z, vx, vy, vz,
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
            if renormalise:
                cut = ~stays & (t < cutoff)
                k_ = ONE / (ONE - t)
                r = select(cut, (r + lr) * k_, r)
                g = select(cut, (g + lg) * k_, g)
                b, a = select(cut, (b + lb) * k_, b), select(cut, ONE, a)
                lr, lg = select(cut, ZERO, lr), select(cut, ZERO, lg)
                lb, la = select(cut, ZERO, lb), select(cut, ZERO, la)
            last = gather(ends, ray, ray < spare)
            joint += joint + within
            put_rows4(cursor, ray, select(stays, i, last), half, joint, wait)
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
                put_rows4(front, ray, v0, fgx, fgy, fgz)
        for k in order:
            if cursor[k, 1] > 0 and depth[k] == FAR:
                middle = np.float32(cursor[k, 1] - 1) - HALF
                depth[k] = geometry[k, 7] + middle * geometry[k, 6]
        counters[0] += samples
        counters[1] += contributing
        store(marks, 0, skipped)
        for lane in range(width):
            counters[2] += marks[lane]

    return march_integrated
