"""March rays whose samples are the ends of segments: transfer functions integrated.

As `renderers.art.kernels.march_scalar`, with the same arrays and the same ways to stop
and go on. Sample ``i`` ends segment ``i``, which the sample before began; a ray takes
the value and the gradient of its last sample along (`front`), so that it needs one cell
at a time wherever it stops. A segment between two empty ends contributes nothing, since
one interval of densities makes all empty space there is (see `IntegratedMarch`). Hence
rays leap as others do, and where they meet something they take the sample before it,
the last empty one, as well; and the first empty one behind it.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.art.cells.brick_views import CellView, Classification
from renderers.art.kernels.interpolate_scalar import U, trilinear
from renderers.art.kernels.march_scalar import leap_out, per_voxel
from renderers.art.kernels.opacity_scalar import HALF, ONE, ZERO
from renderers.art.kernels.segments_scalar import classify, segment
from renderers.art.kernels.shade_scalar import light_up


@njit(cache=True, nogil=True, error_model="numpy")
def march_integrated(
    order: NDArray[np.int32],
    geometry: NDArray[np.float32], count: NDArray[np.int32], cursor: NDArray[np.int32],
    value: NDArray[np.float32], carry: NDArray[np.float32], depth: NDArray[np.float32],
    front: NDArray[np.float32], sums: NDArray[np.float32],
    view: CellView, shift: int, clock: int, table: Classification,
    lights: NDArray[np.float32], material: NDArray[np.float32],
    spacing: NDArray[np.float32],
    least_gradient: np.float32, cutoff: np.float32, renormalise: bool,
    counters: NDArray[np.int64],
) -> None:  # fmt: skip
    """Composite each ray's segments front to back until it ends or misses a cell.

    Arguments as `march_classic` has them. front: float32 (rays + 1, 4), value and
    gradient of the last sample. ``cursor[:, 2]``: the segment it begins, twice, and one
    more if it is not empty. sums: see `segment`. Segments are shaded in their middles
    with the mean of the gradients at their ends. `depth` is the middle of the segment
    in which opacity passes one half.
    """
    mask = (1 << shift) - 1
    n1 = (1 << shift) + 1
    wide, high = int(view.top[0]) + 1, int(view.top[1]) + 1
    each = view.channels
    row, slab = each * n1, each * n1 * n1
    whole = each == 1 and len(view.whole) > 0
    field = view.whole if whole else view.samples
    if whole:
        row = each * (wide + 1)
        slab = row * (high + 1)
    term = np.empty(4, np.float32)
    for ray in order:
        cursor[ray, 3] = 0
        i, end = int(cursor[ray, 0]), int(count[ray])
        if i >= end:
            continue
        joint, within = int(cursor[ray, 2]) >> 1, bool(cursor[ray, 2] & 1)
        ox, oy, oz = geometry[ray, 0], geometry[ray, 1], geometry[ray, 2]
        sx, sy, sz = geometry[ray, 3], geometry[ray, 4], geometry[ray, 5]
        h = geometry[ray, 6]
        px, py, pz = per_voxel(sx), per_voxel(sy), per_voxel(sz)
        per_mm = ONE / h
        vx, vy = sx * spacing[0] * per_mm, sy * spacing[1] * per_mm
        vz = sz * spacing[2] * per_mm
        v0, fgx, fgy, fgz = front[ray, 0], front[ray, 1], front[ray, 2], front[ray, 3]
        p0, e0, r0, g0, b0 = classify(table, v0)
        t = max((ONE - value[ray, 3]) - carry[ray, 3], ZERO)
        while i < end:
            fi = np.float32(i)
            x, y, z = ox + fi * sx, oy + fi * sy, oz + fi * sz
            ix = min(max(int(x), 0), view.top[0])
            iy = min(max(int(y), 0), view.top[1])
            iz = min(max(int(z), 0), view.top[2])
            far = int(view.leap[U((iz * high + iy) * wide + ix)])
            if far > 0 and not (within and joint == i):
                jump = leap_out(x, y, z, px, py, pz, ix, iy, iz, far, end - i)
                counters[2] += jump
                i += jump
                continue
            inside = far == 0
            if inside and joint != i and i > 0:
                inside = False
                counters[2] -= 1
                i -= 1
                fi = np.float32(i)
                x, y, z = ox + fi * sx, oy + fi * sy, oz + fi * sz
                ix = min(max(int(x), 0), view.top[0])
                iy = min(max(int(y), 0), view.top[1])
                iz = min(max(int(z), 0), view.top[2])
            if whole:
                at = iz * slab + iy * row + ix * each
            else:
                cell = (iz >> shift) * view.counts[1] + (iy >> shift)
                cell = cell * view.counts[0] + (ix >> shift)
                slot = view.slots[cell]
                if slot < 0:
                    cursor[ray, 3] = cell + 1
                    break
                if clock > 0:
                    view.stamp[slot] = clock
                lx, ly, lz = ix & mask, iy & mask, iz & mask
                at = (((slot * n1 + lz) * n1 + ly) * n1 + lx) * each
            counters[0] += 1
            # The last sample lies on the volume's face, and rounding beyond it.
            fx = min(max(x - np.float32(ix), ZERO), ONE)
            fy = min(max(y - np.float32(iy), ZERO), ONE)
            fz = min(max(z - np.float32(iz), ZERO), ONE)
            v1 = trilinear(field, at, each, row, slab, fx, fy, fz) * view.unit
            gx, gy, gz = ZERO, ZERO, ZERO
            if each > 1:
                gx = trilinear(view.samples, at + 1, each, row, slab, fx, fy, fz)
                gy = trilinear(view.samples, at + 2, each, row, slab, fx, fy, fz)
                gz = trilinear(view.samples, at + 3, each, row, slab, fx, fy, fz)
            p1, e1, r1, g1, b1 = classify(table, v1)
            alpha, cr, cg, cb = ZERO, ZERO, ZERO, ZERO
            if joint == i and i > 0:
                alpha, cr, cg, cb = segment(
                    table, sums, h, v0, p0, e0, r0, g0, b0, v1, p1, e1, r1, g1, b1
                )
            i += 1
            joint, within = i, inside
            mx, my, mz = HALF * (fgx + gx), HALF * (fgy + gy), HALF * (fgz + gz)
            v0, fgx, fgy, fgz = v1, gx, gy, gz
            p0, e0, r0, g0, b0 = p1, e1, r1, g1, b1
            if not alpha > ZERO:
                continue
            counters[1] += 1
            if each > 1:
                cr, cg, cb = light_up(
                    lights, material, least_gradient, cr, cg, cb, mx, my, mz,
                    (x - HALF * sx) * spacing[0], (y - HALF * sy) * spacing[1],
                    (z - HALF * sz) * spacing[2], vx, vy, vz,
                )  # fmt: skip
            weight = t * alpha
            term[0], term[1], term[2] = weight * cr, weight * cg, weight * cb
            term[3] = weight
            for c in range(4):
                part = term[c] + carry[ray, c]
                sum_ = value[ray, c] + part
                carry[ray, c] = part - (sum_ - value[ray, c])
                value[ray, c] = sum_
            t = max((ONE - value[ray, 3]) - carry[ray, 3], ZERO)
            if t <= HALF and depth[ray] == np.float32(np.inf):
                depth[ray] = geometry[ray, 7] + (fi - HALF) * h
            if t < cutoff:
                if renormalise:
                    part = ONE / (ONE - t)
                    for c in range(3):
                        value[ray, c] = (value[ray, c] + carry[ray, c]) * part
                    value[ray, 3] = ONE
                    carry[ray, :] = ZERO
                i = end
        cursor[ray, 0], cursor[ray, 2] = i, 2 * joint + (1 if within else 0)
        front[ray, 0], front[ray, 1], front[ray, 2], front[ray, 3] = v0, fgx, fgy, fgz
