"""Cones traced into the walls sixteen at a time; the scalar twin tells the method.

The same arithmetic in the same order and so the same bits.
"""

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.fsr.kernels.cones_scalar import (
    BEYOND_FACE,
    LEAST_STEP,
    STEPS,
    voxel_size,
)
from renderers.lanes import (
    absolute,
    any_,
    full,
    lanes,
    load_where,
    maximum,
    minimum,
    select,
    store_where,
)
from renderers.shading.kernels.field_reads import taps

F32 = NDArray[np.float32]

f32 = np.float32
W = 16


@njit(cache=True, nogil=True, error_model="numpy")
def clip(low: Any, high: Any, p: np.float32, s: Any, most: np.float32) -> Any:
    """Shorten lines to what lies between two faces of the grid."""
    moves = absolute(s) > LEAST_STEP
    k = f32(1) / s
    a = -p * k
    b = (most - p) * k
    low = select(moves, maximum(low, minimum(a, b)), low)
    high = select(moves, minimum(high, maximum(a, b)), high)
    if p < f32(0) or p > most:
        low = select(moves, low, f32(np.inf))
    return low, high


@njit(cache=True, nogil=True, error_model="numpy")
def trace_cones(
    values: F32, voxel_from_camera: F32, cones: F32, margin: np.float32, first: int,
    end: int, ends: F32,
) -> None:  # fmt: skip
    """Do as the scalar twin."""
    m = voxel_from_camera
    px, py, pz = m[0, 3], m[1, 3], m[2, 3]
    last_x = f32(values.shape[2] - 1)
    last_y = f32(values.shape[1] - 1)
    last_z = f32(values.shape[0] - 1)
    size_x = voxel_size(m, 0)
    size_y = voxel_size(m, 1)
    size_z = voxel_size(m, 2)
    columns = ends.shape[1]
    plane = cones.shape[1] * columns
    for row in range(first, end):
        for column in range(0, columns, W):
            at = row * columns + column
            here = lanes(W) < np.int32(columns - column)
            dx = load_where(cones, at, here)
            dy = load_where(cones, plane + at, here)
            dz = load_where(cones, 2 * plane + at, here)
            slope = load_where(cones, 3 * plane + at, here)
            longer = load_where(cones, 4 * plane + at, here)
            live = here & ((dx != f32(0)) | (dy != f32(0)) | (dz != f32(0)))
            found = select(live, full(f32(np.inf), W), f32(-1))
            sx = m[0, 0] * dx + m[0, 1] * dy + m[0, 2] * dz
            sy = m[1, 0] * dx + m[1, 1] * dy + m[1, 2] * dz
            sz = m[2, 0] * dx + m[2, 1] * dy + m[2, 2] * dz
            t = full(f32(0), W)
            high = full(f32(np.inf), W)
            t, high = clip(t, high, px, sx, last_x)
            t, high = clip(t, high, py, sy, last_y)
            t, high = clip(t, high, pz, sz, last_z)
            live &= t <= high
            outside = t > f32(0)
            in_air = outside
            t += select(outside, full(BEYOND_FACE, W), f32(0))
            for _ in range(STEPS):
                x = px + t * sx
                y = py + t * sy
                z = pz + t * sz
                live &= (x >= f32(0)) & (y >= f32(0)) & (z >= f32(0))
                live &= (x < last_x) & (y < last_y) & (z < last_z)
                if not any_(live):
                    break
                d = taps(values, x, y, z)
                in_air |= d < f32(0)
                missing = t * slope + margin - d
                gap = minimum(x, last_x - x) * size_x
                gap = minimum(gap, minimum(y, last_y - y) * size_y)
                gap = minimum(gap, minimum(z, last_z - z) * size_z)
                at_face = outside & (missing <= f32(0))
                missing = select(at_face, t * slope - gap, missing)
                met = live & in_air & (missing <= f32(0))
                found = select(met, t * longer, found)
                live &= ~met
                step = maximum(select(in_air, missing, d), margin)
                t += select(live, step, f32(0))
            store_where(ends, at, found, here)
