"""Compiled: albedo, scattering, film and bumped normals of a block of pixels.

Positions are millimetres, voxel coordinates count along the array's x, y, z.
"""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.shading.detail.kernels import (
    MOTTLE_LONG,
    MOTTLE_MIDDLE,
    MOTTLE_SHORT,
    octave,
    ramp,
    vessel,
)
from renderers.shading.surface.block import (
    A2,
    BLUE,
    COVER,
    F0,
    FOOT,
    GREEN,
    HX,
    HY,
    HZ,
    LG,
    LR,
    NX,
    NY,
    NZ,
    PX,
    PY,
    PZ,
    RED,
    SKIN,
    TX,
    TY,
    TZ,
    UX,
    UY,
    UZ,
)

f32 = np.float32
i32 = np.int32
Floats = NDArray[np.float32]

WAVE_LONG = f32(6.5 / (2 * math.pi))
WAVE_MIDDLE = f32(1.6 / (2 * math.pi))
WAVE_SHORT = f32(0.55 / (2 * math.pi))
"""mm per radian of the three octaves: slope x this is the factor on a gradient."""

TISSUE_MIDDLE = f32(0.06) * WAVE_MIDDLE
TISSUE_SHORT = f32(0.04) * WAVE_SHORT
FILM_LONG = f32(0.06) * WAVE_LONG
FILM_MIDDLE = f32(0.09) * WAVE_MIDDLE
FILM_SHORT = f32(0.04) * WAVE_SHORT
VARIANCE_MIDDLE = f32(2 * 0.09**2)
VARIANCE_SHORT = f32(2 * 0.04**2)
"""GGX width squared of film ripples too fine for a pixel."""


@njit(cache=True, nogil=True, error_model="numpy")
def tint_at(
    tint: NDArray[np.uint16],
    shape: tuple[int, int, int],
    x: np.float32,
    y: np.float32,
    z: np.float32,
) -> tuple[np.float32, np.float32]:
    """Interpolate blood code and skin code, 0..255, at voxel coordinates."""
    nz, ny, nx = shape
    x = min(max(x, f32(0)), f32(nx) - f32(1.001))
    y = min(max(y, f32(0)), f32(ny) - f32(1.001))
    z = min(max(z, f32(0)), f32(nz) - f32(1.001))
    i = i32(x)
    j = i32(y)
    k = i32(z)
    x -= f32(i)
    y -= f32(j)
    z -= f32(k)
    at = np.uint64((np.int64(k) * ny + j) * nx + i)
    blood = f32(0)
    skin = f32(0)
    for corner in range(8):
        step = np.uint64(corner & 1)
        step += np.uint64(nx if corner & 2 else 0)
        step += np.uint64(nx * ny if corner & 4 else 0)
        q = (x if corner & 1 else f32(1) - x) * (y if corner & 2 else f32(1) - y)
        q *= z if corner & 4 else f32(1) - z
        pair = i32(tint[at + step])
        blood += q * f32(pair & i32(255))
        skin += q * f32(pair >> i32(8))
    return blood, skin


@njit(cache=True, nogil=True, error_model="numpy")
def paint(
    w: Floats,
    material: NDArray[np.uint8],
    y: int,
    x0: int,
    count: int,
    tint: NDArray[np.uint16],
    shape: tuple[int, int, int],
    blood_bias: np.float32,
    colours: Floats,
    skin_colour: Floats,
    materials: Floats,
    full: bool,
    tile: Floats,
    vessel_tile: Floats,
    to_tile: Floats,
    offsets: Floats,
    eye_mm: Floats,
) -> None:
    """Find albedo, scattering, film and the two bumped normals of a block."""
    bias_root = f32(math.sqrt(blood_bias))
    for i in range(count):
        if w[COVER + i] <= f32(0):
            continue
        row = materials[material[y, x0 + i]]
        share = row[0]
        relief = row[6]
        nx = w[NX + i]
        ny = w[NY + i]
        nz = w[NZ + i]
        code, skin = tint_at(tint, shape, w[UX + i], w[UY + i], w[UZ + i])
        code *= bias_root
        skin *= share * f32(1 / 255)
        a2 = row[5] * row[5]
        tx = nx
        ty = ny
        tz = nz
        hx = nx
        hy = ny
        hz = nz
        if relief > f32(0) or full:
            foot = w[FOOT + i]
            x = eye_mm[0] + w[PX + i]
            y_ = eye_mm[1] + w[PY + i]
            z = eye_mm[2] + w[PZ + i]
            w2 = f32(1) - ramp(f32(0.25), f32(0.5), foot * f32(1 / 1.6))
            m2, b0, b1, b2 = octave(tile, to_tile[1], x, y_, z, False)
            s2 = relief * w2
            rough = VARIANCE_MIDDLE * (f32(1) - w2 * w2)
            gx = FILM_MIDDLE * s2 * b0
            gy = FILM_MIDDLE * s2 * b1
            gz = FILM_MIDDLE * s2 * b2
            qx = TISSUE_MIDDLE * s2 * b0
            qy = TISSUE_MIDDLE * s2 * b1
            qz = TISSUE_MIDDLE * s2 * b2
            if full:
                w3 = f32(1) - ramp(f32(0.25), f32(0.5), foot * f32(1 / 0.55))
                m1, a0, a1, a_2 = octave(tile, to_tile[0], x, y_, z, False)
                m3, c0, c1, c2 = octave(tile, to_tile[2], x, y_, z, False)
                s3 = relief * w3
                rough += VARIANCE_SHORT * (f32(1) - w3 * w3)
                gx += FILM_LONG * relief * a0 + FILM_SHORT * s3 * c0
                gy += FILM_LONG * relief * a1 + FILM_SHORT * s3 * c1
                gz += FILM_LONG * relief * a_2 + FILM_SHORT * s3 * c2
                qx += TISSUE_SHORT * s3 * c0
                qy += TISSUE_SHORT * s3 * c1
                qz += TISSUE_SHORT * s3 * c2
                mottle = MOTTLE_LONG * m1 + MOTTLE_MIDDLE * w2 * m2
                mottle += MOTTLE_SHORT * w3 * m3
                blood = code * code * f32(1 / 65025) * f32(math.exp(mottle))
                blood = with_vessels(
                    blood, skin, x, y_, z, nx, ny, nz, m1, m2, m3, foot,
                    vessel_tile, to_tile, offsets,
                )  # fmt: skip
                code = f32(math.sqrt(min(blood, f32(1)))) * f32(255)
            else:
                rough += VARIANCE_SHORT
            a2 += relief * relief * rough
            d = gx * nx + gy * ny + gz * nz
            hx -= gx - d * nx
            hy -= gy - d * ny
            hz -= gz - d * nz
            k = f32(1) / f32(math.sqrt(hx * hx + hy * hy + hz * hz + f32(1e-20)))
            hx *= k
            hy *= k
            hz *= k
            d = qx * nx + qy * ny + qz * nz
            tx -= qx - d * nx
            ty -= qy - d * ny
            tz -= qz - d * nz
            k = f32(1) / f32(math.sqrt(tx * tx + ty * ty + tz * tz + f32(1e-20)))
            tx *= k
            ty *= k
            tz *= k
        w[TX + i] = tx
        w[TY + i] = ty
        w[TZ + i] = tz
        w[HX + i] = hx
        w[HY + i] = hy
        w[HZ + i] = hz
        if a2 < f32(0.12):
            a2 += skin * (f32(0.12) - a2)
        w[A2 + i] = a2
        w[F0 + i] = row[4]
        w[SKIN + i] = skin
        u = min(code, f32(254.999))
        n = i32(u)
        u -= f32(n)
        low = colours[n]
        high = colours[n + 1]
        red = low[0] + u * (high[0] - low[0])
        green = low[1] + u * (high[1] - low[1])
        blue = low[2] + u * (high[2] - low[2])
        red += skin * (skin_colour[0] - red)
        green += skin * (skin_colour[1] - green)
        blue += skin * (skin_colour[2] - blue)
        w[RED + i] = share * red + row[1]
        w[GREEN + i] = share * green + row[2]
        w[BLUE + i] = share * blue + row[3]
        w[LR + i] = share * (low[3] + u * (high[3] - low[3])) + row[7]
        w[LG + i] = share * (low[4] + u * (high[4] - low[4])) + row[8]


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
    tile: Floats,
    to_tile: Floats,
    offsets: Floats,
) -> np.float32:
    """Add the blood of two sizes of vessel, warped by the mottle's octaves."""
    bend = f32(0.22) * m2
    q, gx, gy, gz = octave(
        tile, to_tile[3],
        x + offsets[0, 0] + bend, y + offsets[0, 1], z + offsets[0, 2] + bend, True,
    )  # fmt: skip
    d = gx * nx + gy * ny + gz * nz
    slope = f32(math.sqrt(max(gx * gx + gy * gy + gz * gz - d * d, f32(0))))
    radius = f32(0.042) * (f32(0.55) + f32(0.45) * m1)
    edge = f32(0.55) * radius + f32(0.02)
    cover = f32(0.6) * vessel(q, slope, radius, edge, foot, f32(0.12))
    bend = f32(0.05) * m3
    q, gx, gy, gz = octave(
        tile, to_tile[4],
        x + offsets[1, 0], y + offsets[1, 1] + bend, z + offsets[1, 2] + bend, True,
    )  # fmt: skip
    d = gx * nx + gy * ny + gz * nz
    slope = f32(math.sqrt(max(gx * gx + gy * gy + gz * gz - d * d, f32(0))))
    radius = f32(0.022) * (f32(0.5) + f32(0.6) * m2)
    edge = f32(0.6) * radius + f32(0.015)
    fine = f32(0.45) * vessel(q, slope, radius, edge, foot, f32(0.35))
    cover = max(cover, fine)
    return blood + cover * (f32(1) - skin) * (f32(0.10) + f32(1.6) * blood)
