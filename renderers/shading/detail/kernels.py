"""Compiled: taps into noise tiles, vessels, and mottle baked into a blood volume.

Coordinates are millimetres relative to the volume's centre, world axes, so that
float32 keeps a micrometre everywhere.
"""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

f32 = np.float32
i32 = np.int32

MOTTLE_LONG = f32(0.26)
MOTTLE_MIDDLE = f32(0.11)
MOTTLE_SHORT = f32(0.07)
"""Standard deviations of log blood content on the three octaves."""


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def ramp(low: np.float32, high: np.float32, x: np.float32) -> np.float32:
    """Give the smoothstep of x from `low` to `high`."""
    t = min(max((x - low) / (high - low), f32(0)), f32(1))
    return t * t * (f32(3) - f32(2) * t)


@njit(cache=True, nogil=True, error_model="numpy")
def octave(
    tile: NDArray[np.float32],
    to_tile: NDArray[np.float32],
    x: np.float32,
    y: np.float32,
    z: np.float32,
    smooth: bool,
) -> tuple[np.float32, np.float32, np.float32, np.float32]:
    """Tap a tile ``(64**3 * 4,)`` at a point in mm: value, gradient per mm.

    smooth: ease the interpolation; zero curves of a plainly trilinear field are
    visibly polygons.
    """
    u = to_tile[0, 0] * x + to_tile[0, 1] * y + to_tile[0, 2] * z
    v = to_tile[1, 0] * x + to_tile[1, 1] * y + to_tile[1, 2] * z
    w = to_tile[2, 0] * x + to_tile[2, 1] * y + to_tile[2, 2] * z
    fu = f32(math.floor(u))
    fv = f32(math.floor(v))
    fw = f32(math.floor(w))
    i = i32(fu)
    j = i32(fv)
    k = i32(fw)
    u -= fu
    v -= fv
    w -= fw
    if smooth:
        u = u * u * (f32(3) - f32(2) * u)
        v = v * v * (f32(3) - f32(2) * v)
        w = w * w * (f32(3) - f32(2) * w)
    x0 = np.uint32(i & 63) << np.uint32(2)
    x1 = np.uint32((i + 1) & 63) << np.uint32(2)
    y0 = np.uint32(j & 63) << np.uint32(8)
    y1 = np.uint32((j + 1) & 63) << np.uint32(8)
    z0 = np.uint32(k & 63) << np.uint32(14)
    z1 = np.uint32((k + 1) & 63) << np.uint32(14)
    u1 = f32(1) - u
    v1 = f32(1) - v
    w1 = f32(1) - w
    r0 = f32(0)
    r1 = f32(0)
    r2 = f32(0)
    r3 = f32(0)
    for corner in range(8):
        a = (x1 if corner & 1 else x0) + (y1 if corner & 2 else y0)
        a += z1 if corner & 4 else z0
        q = (u if corner & 1 else u1) * (v if corner & 2 else v1)
        q *= w if corner & 4 else w1
        r0 += q * tile[a]
        r1 += q * tile[a + np.uint32(1)]
        r2 += q * tile[a + np.uint32(2)]
        r3 += q * tile[a + np.uint32(3)]
    return (
        r0,
        to_tile[0, 0] * r1 + to_tile[1, 0] * r2 + to_tile[2, 0] * r3,
        to_tile[0, 1] * r1 + to_tile[1, 1] * r2 + to_tile[2, 1] * r3,
        to_tile[0, 2] * r1 + to_tile[1, 2] * r2 + to_tile[2, 2] * r3,
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
def bake_mottle(
    blood: NDArray[np.uint8],
    distance: NDArray[np.float32],
    mm_from_voxel: NDArray[np.float32],
    tile: NDArray[np.float32],
    long_to_tile: NDArray[np.float32],
    middle_to_tile: NDArray[np.float32],
    reach_mm: np.float32,
    mottled: NDArray[np.uint8],
    first: int,
    last: int,
) -> None:
    """Multiply the blood fraction of slices ``first..last`` by its long octaves.

    mm_from_voxel: ``(3, 4)`` map from voxel (i, j, k) to mm from the volume's centre.
    Voxels farther than `reach_mm` from the surface are copied: nothing sees them.
    """
    m = mm_from_voxel
    for k in range(first, last):
        for j in range(blood.shape[1]):
            for i in range(blood.shape[2]):
                code = blood[k, j, i]
                if abs(distance[k, j, i]) < reach_mm:
                    u = f32(i)
                    v = f32(j)
                    w = f32(k)
                    x = m[0, 0] * u + m[0, 1] * v + m[0, 2] * w + m[0, 3]
                    y = m[1, 0] * u + m[1, 1] * v + m[1, 2] * w + m[1, 3]
                    z = m[2, 0] * u + m[2, 1] * v + m[2, 2] * w + m[2, 3]
                    a = octave(tile, long_to_tile, x, y, z, False)[0]
                    b = octave(tile, middle_to_tile, x, y, z, False)[0]
                    # codes are sqrt(B): half the exponent
                    grown = f32(code) * f32(
                        math.exp(f32(0.5) * (MOTTLE_LONG * a + MOTTLE_MIDDLE * b))
                    )
                    mottled[k, j, i] = np.uint8(min(grown + f32(0.5), f32(255)))
                else:
                    mottled[k, j, i] = code
