"""Compiled: how far it is to the wall along many rays, sixteen at a time.

To the bits of `path_tracing.sphere_trace`, which follows one. A lane that has its
answer takes the next ray of the list: some rays meet a wall after three steps, some
slide along one for fifty.
"""

import numpy as np
from numba import njit

from renderers.shading.kernels.elementary import rotated
from renderers.shading.kernels.field_reads import (
    DistanceField,
    is_outside,
    taps,
    to_voxels,
)
from renderers.shading.kernels.path_tracing import (
    ARRIVED_MM,
    SHORTEST_STEP_MM,
    STEP_LIMIT,
)
from renderers.simd import (
    any_,
    count,
    full,
    lanes,
    maximum,
    minimum,
    put_rows4,
    rank,
    rows8,
    select,
)
from renderers.simd.arrays import Floats, f32

W = 16
_FREE = W // 4
"""Lanes without a ray that are worth a look at the list."""


@njit(cache=True, nogil=True, error_model="numpy")
def sphere_trace_rays(
    field: DistanceField, rays: Floats, longest: np.float32, found: Floats
) -> None:
    """Write how far the wall is along rays, as `sphere_trace` gives it.

    rays: ``(n, 8)``: three numbers where each begins, mm from the eye along world axes,
    three of its unit direction, two to spare. found: ``(n + 1, 4)``, the first of four
    numbers for each, and a row to spare.
    """
    distance, m, _ = field
    many = np.int32(rays.shape[0])
    zero = full(f32(0), W)
    x0, y0, z0, vx, vy, vz, t = zero, zero, zero, zero, zero, zero, zero
    at = lanes(W) * np.int32(0)
    left, live, taken = at, at > 0, 0
    while True:
        working = count(live)
        if taken < many and working <= W - _FREE:
            number = rank(~live) + np.int32(taken)
            fresh = ~live & (number < many)
            at = select(fresh, number, at)
            px, py, pz, dx, dy, dz, _, _ = rows8(rays, select(fresh, number, 0))
            px, py, pz = to_voxels(field, (px, py, pz))
            dx, dy, dz = rotated(m, dx, dy, dz)
            x0, y0, z0 = (
                select(fresh, px, x0), select(fresh, py, y0), select(fresh, pz, z0)
            )  # fmt: skip
            vx, vy, vz = (
                select(fresh, dx, vx), select(fresh, dy, vy), select(fresh, dz, vz)
            )  # fmt: skip
            t = select(fresh, f32(0), t)
            left = select(fresh, np.int32(STEP_LIMIT), left)
            live |= fresh
            taken += count(fresh)
        elif working == 0:
            break
        x, y, z = x0 + t * vx, y0 + t * vy, z0 + t * vz
        d = taps(distance, x, y, z)
        out = is_outside(distance, x, y, z)
        met = live & ~out & (d > f32(-ARRIVED_MM))
        # at most the rest of the way
        way = select(met, t - minimum(d, f32(0)), f32(-1))
        t += maximum(f32(-0.95) * d, f32(SHORTEST_STEP_MM))
        left -= np.int32(1)
        ended = live & (met | out | ~(t < longest) | (left == 0))
        if any_(ended):
            put_rows4(found, select(ended, at, many), way, zero, zero, zero)
            live &= ~ended
