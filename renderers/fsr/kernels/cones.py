"""Cones traced into the walls, sixteen at a time: what lies behind is hidden."""

import math

import numpy as np
from numba import njit

from renderers.fsr.kernels.array_types import F32, Lanes
from renderers.fsr.kernels.view_planes import EQUIDISTANT, Lens
from renderers.shading.kernels.field_reads import taps
from renderers.simd import (
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

f32 = np.float32

STEPS = 512
"""At most, along one cone."""
LEAST_STEP = f32(1e-12)
"""Voxels a mm; a line that is slower runs along the faces of the grid."""
BEYOND_FACE = f32(1e-3)
"""mm that a cone begins inside the grid, or rounding would leave it outside."""
W = 16


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _direction(u: float, v: float, lens: Lens) -> tuple[float, float, float]:
    """Return the camera-frame unit ray through a pixel position."""
    projection, extent, width, height = lens
    half = 0.5 * min(width, height)
    x = (u - 0.5 * width) / half
    y = (0.5 * height - v) / half
    if projection == EQUIDISTANT:
        r = math.sqrt(x * x + y * y)
        theta = min(r * extent, math.pi)
        k = math.sin(theta) / r if r > 1e-9 else extent
        return k * x, k * y, math.cos(theta)
    x *= math.tan(extent)
    y *= math.tan(extent)
    k = 1.0 / math.sqrt(x * x + y * y + 1.0)
    return k * x, k * y, k


@njit(cache=True, nogil=True, error_model="numpy")
def aim_cones(lens: Lens, side: int, cones: F32) -> None:
    """Find the cones around squares of `side` pixels; a lens has the same in any view.

    cones: ``(5, rows, columns)``, the axis in the camera's frame, how much the radius
    grows along it, and how much longer than the axis the sides are; an axis of zeros
    where the lens shows nothing.
    """
    projection, _, width, height = lens
    for row in range(cones.shape[1]):
        for column in range(cones.shape[2]):
            u0 = column * side
            v0 = row * side
            dx, dy, dz = _direction(u0 + 0.5 * side, v0 + 0.5 * side, lens)
            cosine = 1.0
            for corner in range(4):
                cx, cy, cz = _direction(
                    u0 + side * (corner & 1), v0 + side * (corner >> 1), lens
                )
                cosine = min(cosine, dx * cx + dy * cy + dz * cz)
            if projection == EQUIDISTANT:
                # squares wholly outside the round stop show nothing at any depth
                gap_x = max(abs(u0 + 0.5 * side - 0.5 * width) - 0.5 * side, 0.0)
                gap_y = max(abs(v0 + 0.5 * side - 0.5 * height) - 0.5 * side, 0.0)
                stop = 0.5 * min(width, height) + 4.0
                if gap_x * gap_x + gap_y * gap_y > stop * stop:
                    dx = dy = dz = 0.0
            cones[0, row, column] = dx
            cones[1, row, column] = dy
            cones[2, row, column] = dz
            longer = 1.0 / max(cosine, 0.1)
            cones[3, row, column] = math.sqrt(max(1.0 - cosine * cosine, 0.0)) * longer
            cones[4, row, column] = longer


@njit(cache=True, nogil=True, error_model="numpy")
def voxel_size(m: F32, axis: int) -> np.float32:
    """Return the millimetres of a voxel along one of the grid's axes."""
    x, y, z = m[axis, 0], m[axis, 1], m[axis, 2]
    return f32(1) / f32(math.sqrt(x * x + y * y + z * z))


@njit(cache=True, nogil=True, error_model="numpy")
def clip(low: Lanes, high: Lanes, p: np.float32, s: Lanes, most: np.float32) -> Lanes:
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
    """Fill, per square of pixels, the depth behind which nothing shows.

    values: signed distance (mm), ``[z, y, x]``. voxel_from_camera: ``(3, 4)``. cones:
    by `aim_cones`. A cone around the square's rays ends where a ball of tissue spans
    it: where the signed distance exceeds the cone's radius by `margin` (mm). The
    distance changes by less than its argument, so stepping by what is missing passes no
    such place. A cone from outside the grid begins where it enters; what lies behind
    tissue there is hidden by the face at which the grid cuts through it. Rows
    `first`..`end` - 1 of squares are done; +inf where the cone leaves the grid, -1
    where the lens shows nothing.
    """
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
