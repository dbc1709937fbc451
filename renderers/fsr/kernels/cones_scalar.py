"""Cones traced into the walls, one after the other."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.shading.kernels.virtual_lights import tap

F32 = NDArray[np.float32]

f32 = np.float32

STEPS = 512
"""At most, along one cone."""
LEAST_STEP = f32(1e-12)
"""Voxels a mm; a line that is slower runs along the faces of the grid."""
BEYOND_FACE = f32(1e-3)
"""mm that a cone begins inside the grid, or rounding would leave it outside."""


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _direction(
    u: float, v: float, projection: int, extent: float, width: int, height: int
) -> tuple[float, float, float]:
    """Give the camera-frame unit ray through a pixel position."""
    half = 0.5 * min(width, height)
    x = (u - 0.5 * width) / half
    y = (0.5 * height - v) / half
    if projection == 0:
        r = math.sqrt(x * x + y * y)
        theta = min(r * extent, math.pi)
        k = math.sin(theta) / r if r > 1e-9 else extent
        return k * x, k * y, math.cos(theta)
    x *= math.tan(extent)
    y *= math.tan(extent)
    k = 1.0 / math.sqrt(x * x + y * y + 1.0)
    return k * x, k * y, k


@njit(cache=True, nogil=True, error_model="numpy")
def aim_cones(
    projection: int, extent: float, width: int, height: int, side: int, cones: F32
) -> None:
    """Find the cones around squares of `side` pixels; a lens has the same in any view.

    cones: ``(5, rows, columns)``, the axis in the camera's frame, how much the radius
    grows along it, and how much longer than the axis the sides are; an axis of zeros
    where the lens shows nothing.
    """
    for row in range(cones.shape[1]):
        for column in range(cones.shape[2]):
            u0 = column * side
            v0 = row * side
            dx, dy, dz = _direction(
                u0 + 0.5 * side, v0 + 0.5 * side, projection, extent, width, height
            )
            cosine = 1.0
            for corner in range(4):
                cx, cy, cz = _direction(
                    u0 + side * (corner & 1),
                    v0 + side * (corner >> 1),
                    projection,
                    extent,
                    width,
                    height,
                )
                cosine = min(cosine, dx * cx + dy * cy + dz * cz)
            if projection == 0:
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
    """Give the millimetres of a voxel along one of the grid's axes."""
    x, y, z = m[axis, 0], m[axis, 1], m[axis, 2]
    return f32(1) / f32(math.sqrt(x * x + y * y + z * z))


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _enter(start: F32, step: F32, last: F32) -> np.float32:
    """Give the depth at which a line is first inside the grid; +inf if it never is."""
    low, high = f32(0), f32(np.inf)
    for axis in range(3):
        p, s, most = start[axis], step[axis], last[axis]
        if abs(s) > LEAST_STEP:
            k = f32(1) / s
            a, b = -p * k, (most - p) * k
            low = max(low, min(a, b))
            high = min(high, max(a, b))
        elif p < f32(0) or p > most:
            low = f32(np.inf)
    return low if low <= high else f32(np.inf)


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
    such place.
    A cone from outside the grid begins where it enters; what lies behind tissue there
    is hidden by the face at which the grid cuts through it.
    Rows `first`..`end` - 1 of squares are done; +inf where the cone leaves the grid, -1
    where the lens shows nothing.
    """
    m = voxel_from_camera
    start = m[:, 3].copy()
    step = np.empty(3, np.float32)
    last = np.empty(3, np.float32)
    size = np.empty(3, np.float32)
    for axis in range(3):
        last[axis] = values.shape[2 - axis] - 1
        size[axis] = voxel_size(m, axis)
    for row in range(first, end):
        for column in range(ends.shape[1]):
            dx, dy, dz = (
                cones[0, row, column],
                cones[1, row, column],
                cones[2, row, column],
            )
            slope, longer = cones[3, row, column], cones[4, row, column]
            if dx == f32(0) and dy == f32(0) and dz == f32(0):
                ends[row, column] = f32(-1)
                continue
            for axis in range(3):
                step[axis] = m[axis, 0] * dx + m[axis, 1] * dy + m[axis, 2] * dz
            ends[row, column] = f32(np.inf)
            t = _enter(start, step, last)
            # outside there is air
            outside = t > f32(0)
            in_air = outside
            t += BEYOND_FACE if outside else f32(0)
            for _ in range(STEPS):
                x = start[0] + t * step[0]
                y = start[1] + t * step[1]
                z = start[2] + t * step[2]
                inside = (x >= f32(0)) & (y >= f32(0)) & (z >= f32(0))
                if not (inside & (x < last[0]) & (y < last[1]) & (z < last[2])):
                    break
                d = tap(values, x, y, z)
                # an eye in the tissue looks into the first air that it meets
                in_air = in_air or d < f32(0)
                missing = t * slope + margin - d
                if missing <= f32(0) and outside:
                    # what is beyond a side of the grid hides nothing
                    gap = min(x, last[0] - x) * size[0]
                    gap = min(gap, min(y, last[1] - y) * size[1])
                    gap = min(gap, min(z, last[2] - z) * size[2])
                    missing = t * slope - gap
                if in_air and missing <= f32(0):
                    ends[row, column] = t * longer
                    break
                t += max(missing if in_air else d, margin)
