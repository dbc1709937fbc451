"""Compiled: a distance field read at one place, and to the same bits at many."""

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from renderers.shading.kernels.elementary import Three, along_axes
from renderers.simd import cell1, maximum, minimum, sqrt
from renderers.simd import f32 as to_real
from renderers.simd import i32 as to_whole
from renderers.simd.arrays import Floats, Lanes, f32

Place = tuple[np.float32, np.float32, np.float32]


class DistanceField(NamedTuple):
    """Distances to the wall, negative in air, seen from an eye.

    values: ``(nz, ny, nx)`` mm. to_voxel: ``(3, 3)``, eye: ``(3,)``; voxel coordinates
    are ``to_voxel @ (place - eye_mm) + eye``.
    """

    values: Floats
    to_voxel: Floats
    eye: Floats


@njit(cache=True, nogil=True, error_model="numpy")
def to_voxels(field: DistanceField, place: Three) -> Three:
    """Return voxel coordinates of a place, or of lanes of them, in mm from the eye."""
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
    """Return which voxel coordinates lie off the grid."""
    nz, ny, nx = values.shape
    out = (x < f32(0)) | (x > f32(nx - 1)) | (y < f32(0)) | (y > f32(ny - 1))
    return out | (z < f32(0)) | (z > f32(nz - 1))


@njit(cache=True, nogil=True, error_model="numpy")
def wall_normals(values: Floats, m: Floats, x: Lanes, y: Lanes, z: Lanes) -> Three:
    """Return unit normals towards air at voxel coordinates, along world axes."""
    h = f32(0.6)
    gx = taps(values, x + h, y, z) - taps(values, x - h, y, z)
    gy = taps(values, x, y + h, z) - taps(values, x, y - h, z)
    gz = taps(values, x, y, z + h) - taps(values, x, y, z - h)
    wx, wy, wz = along_axes(m, gx, gy, gz)
    # distance grows into tissue: the normal towards air is against the gradient
    scale = f32(-1) / sqrt(wx * wx + wy * wy + wz * wz + f32(1e-12))
    return wx * scale, wy * scale, wz * scale


@njit(cache=True, nogil=True, error_model="numpy")
def sobel_normal(
    field: DistanceField, x: np.float32, y: np.float32, z: np.float32
) -> Place:
    """Return the unit normal towards air at voxel coordinates, along world axes.

    Of Sobel's gradients between the grid's points, as the ray tracer has them: a wall
    is the same one whether an eye or a path meets it. Their interpolation is one sum
    over 4 x 4 x 4 values, with smooth weights across and a difference's along; it
    reads little more than three differences of two interpolations.
    """
    values, m, _ = field
    nz, ny, nx = values.shape
    x = min(max(x, f32(0)), f32(nx - 1))
    y = min(max(y, f32(0)), f32(ny - 1))
    z = min(max(z, f32(0)), f32(nz - 1))
    i, j, k = np.int32(x), np.int32(y), np.int32(z)
    x -= f32(i)
    y -= f32(j)
    z -= f32(k)
    gx = gy = gz = f32(0)
    for c in range(4):
        plane = min(max(k + c - 1, 0), nz - 1)
        smooth_z, along_z = _sobel_weights(c, z)
        for b in range(4):
            row = min(max(j + b - 1, 0), ny - 1)
            smooth_y, along_y = _sobel_weights(b, y)
            smooth = along = f32(0)
            for a in range(4):
                value = values[plane, row, min(max(i + a - 1, 0), nx - 1)]
                smooth_x, along_x = _sobel_weights(a, x)
                smooth += smooth_x * value
                along += along_x * value
            gx += smooth_z * smooth_y * along
            gy += smooth_z * along_y * smooth
            gz += along_z * smooth_y * smooth
    wx, wy, wz = along_axes(m, gx, gy, gz)
    # distance grows into tissue: the normal towards air is against the gradient
    length = f32(math.sqrt(wx * wx + wy * wy + wz * wz + f32(1e-12)))
    scale = f32(-1) / length
    return wx * scale, wy * scale, wz * scale


@njit(cache=True, nogil=True, error_model="numpy")
def _sobel_weights(tap: int, part: np.float32) -> tuple[np.float32, np.float32]:
    """Return what one of four values in a row weighs across it and along it.

    ``1 2 1`` and ``-1 0 1`` about the second and the third, mixed by `part` of the way.
    """
    rest = f32(1) - part
    if tap == 0:
        return rest, -rest
    if tap == 1:
        return f32(1) + rest, -part
    if tap == 2:
        return f32(1) + part, rest
    return part, part
