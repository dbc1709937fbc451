"""Compiled: a distance field read at many places at once.

To the bits of `bounce.kernels.tap` and `paths.kernels.wall_normal`, which read it at
one.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.lanes import cell1, maximum, minimum, sqrt
from renderers.lanes import f32 as to_real
from renderers.lanes import i32 as to_whole
from renderers.shading.kernels.elementary import Lanes, Three

f32 = np.float32
Floats = NDArray[np.float32]


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
