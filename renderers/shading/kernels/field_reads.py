"""Compiled: a distance field read at one place, and to the same bits at many."""

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.lanes import cell1, maximum, minimum, sqrt
from renderers.lanes import f32 as to_real
from renderers.lanes import i32 as to_whole
from renderers.shading.kernels.elementary import Lanes, Three

f32 = np.float32
Floats = NDArray[np.float32]
Place = tuple[np.float32, np.float32, np.float32]


class DistanceField(NamedTuple):
    """Distances to the wall, negative in air, seen from an eye.

    values: ``(nz, ny, nx)`` mm. to_voxel: ``(3, 3)``, eye: ``(3,)``; voxel coordinates
    are ``to_voxel @ (place - eye_mm) + eye``.
    """

    values: NDArray[np.float32]
    to_voxel: NDArray[np.float32]
    eye: NDArray[np.float32]


@njit(cache=True, nogil=True, error_model="numpy")
def to_voxels(field: DistanceField, place: Place) -> Place:
    """Return the voxel coordinates of a place in mm from the eye."""
    _, m, eye = field
    x, y, z = place
    return (
        eye[0] + m[0, 0] * x + m[0, 1] * y + m[0, 2] * z,
        eye[1] + m[1, 0] * x + m[1, 1] * y + m[1, 2] * z,
        eye[2] + m[2, 0] * x + m[2, 1] * y + m[2, 2] * z,
    )


@njit(cache=True, nogil=True, error_model="numpy")
def tap(values: Floats, x: np.float32, y: np.float32, z: np.float32) -> np.float32:
    """Interpolate trilinearly at voxel coordinates, clamped to the grid."""
    nz, ny, nx = values.shape
    x = min(max(x, f32(0)), f32(nx) - f32(1.001))
    y = min(max(y, f32(0)), f32(ny) - f32(1.001))
    z = min(max(z, f32(0)), f32(nz) - f32(1.001))
    i = np.int32(x)
    j = np.int32(y)
    k = np.int32(z)
    x -= f32(i)
    y -= f32(j)
    z -= f32(k)
    a = values[k, j, i] + x * (values[k, j, i + 1] - values[k, j, i])
    b = values[k, j + 1, i] + x * (values[k, j + 1, i + 1] - values[k, j + 1, i])
    c = values[k + 1, j, i] + x * (values[k + 1, j, i + 1] - values[k + 1, j, i])
    d = values[k + 1, j + 1, i] + x * (
        values[k + 1, j + 1, i + 1] - values[k + 1, j + 1, i]
    )
    a += y * (b - a)
    c += y * (d - c)
    result: np.float32 = a + z * (c - a)
    return result


@njit(cache=True, nogil=True, error_model="numpy")
def taps(values: Floats, x: Lanes, y: Lanes, z: Lanes) -> Lanes:
    """Interpolate trilinearly at voxel coordinates, clamped to the grid."""
    nz, ny, nx = values.shape
    x = minimum(maximum(x, f32(0)), f32(nx) - f32(1.001))
    y = minimum(maximum(y, f32(0)), f32(ny) - f32(1.001))
    z = minimum(maximum(z, f32(0)), f32(nz) - f32(1.001))
    i = to_whole(x)
    j = to_whole(y)
    k = to_whole(z)
    x -= to_real(i)
    y -= to_real(j)
    z -= to_real(k)
    at = i + j * np.int32(nx) + k * np.int32(nx * ny)
    return cell1(values, at, nx, nx * ny, x, y, z)


@njit(cache=True, nogil=True, error_model="numpy")
def is_outside(values: Floats, x: Lanes, y: Lanes, z: Lanes) -> Lanes:
    """Say which voxel coordinates lie off the grid."""
    nz, ny, nx = values.shape
    out = (x < f32(0)) | (x > f32(nx - 1)) | (y < f32(0)) | (y > f32(ny - 1))
    return out | (z < f32(0)) | (z > f32(nz - 1))


@njit(cache=True, nogil=True, error_model="numpy")
def wall_normal(
    values: Floats, m: Floats, x: np.float32, y: np.float32, z: np.float32
) -> Place:
    """Give the unit normal towards air at voxel coordinates, along world axes."""
    h = f32(0.6)
    gx = tap(values, x + h, y, z) - tap(values, x - h, y, z)
    gy = tap(values, x, y + h, z) - tap(values, x, y - h, z)
    gz = tap(values, x, y, z + h) - tap(values, x, y, z - h)
    wx = m[0, 0] * gx + m[1, 0] * gy + m[2, 0] * gz
    wy = m[0, 1] * gx + m[1, 1] * gy + m[2, 1] * gz
    wz = m[0, 2] * gx + m[1, 2] * gy + m[2, 2] * gz
    # distance grows into tissue: the normal towards air is against the gradient
    scale = f32(-1) / f32(math.sqrt(wx * wx + wy * wy + wz * wz + f32(1e-12)))
    return wx * scale, wy * scale, wz * scale


@njit(cache=True, nogil=True, error_model="numpy")
def wall_normals(values: Floats, m: Floats, x: Lanes, y: Lanes, z: Lanes) -> Three:
    """Give unit normals towards air at voxel coordinates, along world axes."""
    h = f32(0.6)
    gx = taps(values, x + h, y, z) - taps(values, x - h, y, z)
    gy = taps(values, x, y + h, z) - taps(values, x, y - h, z)
    gz = taps(values, x, y, z + h) - taps(values, x, y, z - h)
    wx = m[0, 0] * gx + m[1, 0] * gy + m[2, 0] * gz
    wy = m[0, 1] * gx + m[1, 1] * gy + m[2, 1] * gz
    wz = m[0, 2] * gx + m[1, 2] * gy + m[2, 2] * gz
    # distance grows into tissue: the normal towards air is against the gradient
    scale = f32(-1) / sqrt(wx * wx + wy * wy + wz * wz + f32(1e-12))
    return wx * scale, wy * scale, wz * scale
