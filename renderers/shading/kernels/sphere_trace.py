"""Compiled: how far it is to the wall along many rays, sixteen at a time.

To the bits of `path_tracing.sphere_trace`, which follows one. A lane that has its
answer takes the next ray of the list: some rays meet a wall after three steps, some
slide along one for fifty.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.lanes import (
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
from renderers.shading.kernels.field_reads import DistanceField, is_outside, taps
from renderers.shading.kernels.path_tracing import (
    ARRIVED_MM,
    SHORTEST_STEP_MM,
    STEP_LIMIT,
)

f32 = np.float32
Floats = NDArray[np.float32]

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
    distance, m, eye = field
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
            x0 = select(fresh, eye[0] + m[0, 0] * px + m[0, 1] * py + m[0, 2] * pz, x0)
            y0 = select(fresh, eye[1] + m[1, 0] * px + m[1, 1] * py + m[1, 2] * pz, y0)
            z0 = select(fresh, eye[2] + m[2, 0] * px + m[2, 1] * py + m[2, 2] * pz, z0)
            vx = select(fresh, m[0, 0] * dx + m[0, 1] * dy + m[0, 2] * dz, vx)
            vy = select(fresh, m[1, 0] * dx + m[1, 1] * dy + m[1, 2] * dz, vy)
            vz = select(fresh, m[2, 0] * dx + m[2, 1] * dy + m[2, 2] * dz, vz)
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
