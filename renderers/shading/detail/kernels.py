"""Compiled: taps into noise tiles, and vessels.

Coordinates are millimetres relative to the volume's centre, world axes, so that
float32 keeps a micrometre everywhere.
"""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.shading.lanes.kernels import rows8

f32 = np.float32
i32 = np.int32

ORIGIN = 8192
"""A multiple of the tile's period beyond any patient: 8192 tile voxels are 79 cm of
the finest octave."""

MOTTLE_LONG = f32(0.26)
MOTTLE_MIDDLE = f32(0.11)
MOTTLE_SHORT = f32(0.07)
"""Standard deviations of log blood content on the three octaves."""


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def exp_negative(x: np.float32) -> np.float32:
    """Give exp(x) for x <= 0, to 1e-6 for x > -6; no call, so that loops vectorise."""
    y = max(x * f32(1.4426950408889634), f32(-126.0))
    # the shift may round k up or down, but what is left of y is exact
    k = i32(y + f32(127))
    r = y - f32(k - i32(127))
    p = f32(1.8775767e-3)
    p = p * r + f32(8.9893397e-3)
    p = p * r + f32(5.5826318e-2)
    p = p * r + f32(2.4015361e-1)
    p = p * r + f32(6.9315308e-1)
    p = p * r + f32(0.99999994)
    return p * i32(k << i32(23)).view(np.float32)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def ramp(low: np.float32, high: np.float32, x: np.float32) -> np.float32:
    """Give the smoothstep of x from `low` to `high`."""
    t = min(max((x - low) / (high - low), f32(0)), f32(1))
    return t * t * (f32(3) - f32(2) * t)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def tap_tile(
    tile: NDArray[np.float32],
    u: np.float32,
    v: np.float32,
    w: np.float32,
    smooth: bool,
) -> tuple[np.float32, np.float32, np.float32, np.float32]:
    """Tap a tile ``(64**3 * 4,)`` at tile voxels: value, gradient per tile voxel.

    smooth: ease the interpolation; zero curves of a plainly trilinear field are
    visibly polygons.
    """
    # int() cuts towards zero: start far enough on the positive side of the period
    i = i32(u + f32(ORIGIN))
    j = i32(v + f32(ORIGIN))
    k = i32(w + f32(ORIGIN))
    u -= f32(i - i32(ORIGIN))
    v -= f32(j - i32(ORIGIN))
    w -= f32(k - i32(ORIGIN))
    if smooth:
        u = u * u * (f32(3) - f32(2) * u)
        v = v * v * (f32(3) - f32(2) * v)
        w = w * w * (f32(3) - f32(2) * w)
    result: tuple[np.float32, np.float32, np.float32, np.float32] = rows8(
        tile,
        np.int64(i & 63) << 2,
        np.int64((i + 1) & 63) << 2,
        np.int64(j & 63) << 8,
        np.int64((j + 1) & 63) << 8,
        np.int64(k & 63) << 14,
        np.int64((k + 1) & 63) << 14,
        u,
        v,
        w,
    )
    return result


@njit(cache=True, nogil=True, error_model="numpy")
def octave(
    tile: NDArray[np.float32],
    to_tile: NDArray[np.float32],
    which: int,
    x: np.float32,
    y: np.float32,
    z: np.float32,
    smooth: bool,
) -> tuple[np.float32, np.float32, np.float32, np.float32]:
    """Tap a tile ``(64**3 * 4,)`` at a point in mm: value, gradient per mm.

    to_tile: ``(n, 3, 3)``, of which matrix `which` maps millimetres to tile voxels
    (a view of it, made for every pixel, would cost more than the tap).
    """
    m00 = to_tile[which, 0, 0]
    m01 = to_tile[which, 0, 1]
    m02 = to_tile[which, 0, 2]
    m10 = to_tile[which, 1, 0]
    m11 = to_tile[which, 1, 1]
    m12 = to_tile[which, 1, 2]
    m20 = to_tile[which, 2, 0]
    m21 = to_tile[which, 2, 1]
    m22 = to_tile[which, 2, 2]
    u = m00 * x + m01 * y + m02 * z
    v = m10 * x + m11 * y + m12 * z
    w = m20 * x + m21 * y + m22 * z
    r0, r1, r2, r3 = tap_tile(tile, u, v, w, smooth)
    return (
        r0,
        m00 * r1 + m10 * r2 + m20 * r3,
        m01 * r1 + m11 * r2 + m21 * r3,
        m02 * r1 + m12 * r2 + m22 * r3,
    )


@njit(cache=True, nogil=True, error_model="numpy")
def vessel(
    value: np.float32,
    slope: np.float32,
    radius: np.float32,
    edge: np.float32,
    footprint: np.float32,
    flattest: np.float32,
) -> np.float32:
    """Give the cover 0..1 of a vessel that follows the zero curve of a noise.

    value, slope: noise at the point and the length of its tangential gradient, 1/mm;
    their ratio is the distance to the curve in mm, so the width does not swell where
    the noise is flat. radius, edge: mm. footprint: mm a pixel covers; a vessel
    thinner than that fades instead of flickering. flattest: below this slope the
    zero set is a blot and not a curve.
    """
    if radius <= f32(0) or slope <= flattest:
        return f32(0)
    soft = max(edge, f32(0.7) * footprint)
    inside = f32(1) - ramp(radius - soft, radius + soft, abs(value) / slope)
    return inside * min(f32(1), radius / (f32(0.7) * footprint))


@njit(cache=True, nogil=True, error_model="numpy")
def with_vessels(
    blood: np.float32,
    skin: np.float32,
    x: np.float32,
    y: np.float32,
    z: np.float32,
    nx: np.float32,
    ny: np.float32,
    nz: np.float32,
    m1: np.float32,
    m2: np.float32,
    m3: np.float32,
    foot: np.float32,
    tile: NDArray[np.float32],
    to_tile: NDArray[np.float32],
    offsets: NDArray[np.float32],
) -> np.float32:
    """Add the blood of two sizes of vessel, warped by the mottle's octaves."""
    bend = f32(0.22) * m2
    q, gx, gy, gz = octave(
        tile, to_tile, 3,
        x + offsets[0, 0] + bend, y + offsets[0, 1], z + offsets[0, 2] + bend, True,
    )  # fmt: skip
    d = gx * nx + gy * ny + gz * nz
    slope = f32(math.sqrt(max(gx * gx + gy * gy + gz * gz - d * d, f32(0))))
    radius = f32(0.042) * (f32(0.55) + f32(0.45) * m1)
    edge = f32(0.55) * radius + f32(0.02)
    cover = f32(0.6) * vessel(q, slope, radius, edge, foot, f32(0.12))
    bend = f32(0.05) * m3
    q, gx, gy, gz = octave(
        tile, to_tile, 4,
        x + offsets[1, 0], y + offsets[1, 1] + bend, z + offsets[1, 2] + bend, True,
    )  # fmt: skip
    d = gx * nx + gy * ny + gz * nz
    slope = f32(math.sqrt(max(gx * gx + gy * gy + gz * gz - d * d, f32(0))))
    radius = f32(0.022) * (f32(0.5) + f32(0.6) * m2)
    edge = f32(0.6) * radius + f32(0.015)
    fine = f32(0.45) * vessel(q, slope, radius, edge, foot, f32(0.35))
    cover = max(cover, fine)
    return blood + cover * (f32(1) - skin) * (f32(0.10) + f32(1.6) * blood)
