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
    exp_negative,
    ramp,
    tap_tile,
    with_vessels,
)
from renderers.shading.lanes.kernels import byte_pairs, rows2
from renderers.shading.relief.kernels import bump
from renderers.shading.surface.block import (
    A2,
    ADD_BLUE,
    ADD_GREEN,
    ADD_LG,
    ADD_LR,
    ADD_RED,
    BLUE,
    CODE,
    F0,
    FOOT,
    GREEN,
    LG,
    LONG,
    LR,
    MIDDLE,
    NX,
    NY,
    NZ,
    PX,
    PY,
    PZ,
    RED,
    RELIEF,
    SHARE,
    SHORT,
    SKIN,
    UX,
    UY,
    UZ,
    N,
)

f32 = np.float32
i32 = np.int32
Floats = NDArray[np.float32]

E_TO_4 = math.exp(4)


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
    at = (np.int64(k) * ny + j) * nx + i
    blood, skin, _, _ = byte_pairs(tint, at, nx, nx * ny, x, y, z)
    return blood, skin


@njit(cache=True, nogil=True, error_model="numpy")
def set_materials(
    w: Floats,
    material: NDArray[np.uint8],
    y: int,
    x0: int,
    count: int,
    materials: Floats,
) -> None:
    """Spread the material table over a block; blocks of tissue alone are quick."""
    kinds = 0
    for i in range(count):
        kinds |= material[y, x0 + i]
    f0 = materials[0, 4]
    a2 = materials[0, 5] * materials[0, 5]
    for i in range(N):
        w[SHARE + i] = f32(1)
        w[RELIEF + i] = f32(1)
        w[F0 + i] = f0
        w[A2 + i] = a2
        w[ADD_RED + i] = f32(0)
        w[ADD_GREEN + i] = f32(0)
        w[ADD_BLUE + i] = f32(0)
        w[ADD_LR + i] = f32(0)
        w[ADD_LG + i] = f32(0)
    if kinds == 0:
        return
    for i in range(count):
        m = np.int64(material[y, x0 + i])
        w[SHARE + i] = materials[m, 0]
        w[ADD_RED + i] = materials[m, 1]
        w[ADD_GREEN + i] = materials[m, 2]
        w[ADD_BLUE + i] = materials[m, 3]
        w[F0 + i] = materials[m, 4]
        w[A2 + i] = materials[m, 5] * materials[m, 5]
        w[RELIEF + i] = materials[m, 6]
        w[ADD_LR + i] = materials[m, 7]
        w[ADD_LG + i] = materials[m, 8]


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def tap_octave(
    w: Floats,
    count: int,
    tile: Floats,
    to_tile: Floats,
    which: int,
    eye_mm: Floats,
    slot: int,
) -> None:
    """Tap an octave at a block's points: value and gradient per mm at `slot`.

    Only the tap itself is scalar; the turns into the tile and back are vector code.
    """
    m00, m01, m02 = to_tile[which, 0, 0], to_tile[which, 0, 1], to_tile[which, 0, 2]
    m10, m11, m12 = to_tile[which, 1, 0], to_tile[which, 1, 1], to_tile[which, 1, 2]
    m20, m21, m22 = to_tile[which, 2, 0], to_tile[which, 2, 1], to_tile[which, 2, 2]
    ex, ey, ez = eye_mm[0], eye_mm[1], eye_mm[2]
    for i in range(N):
        x = ex + w[PX + i]
        y = ey + w[PY + i]
        z = ez + w[PZ + i]
        w[slot + N + i] = m00 * x + m01 * y + m02 * z
        w[slot + 2 * N + i] = m10 * x + m11 * y + m12 * z
        w[slot + 3 * N + i] = m20 * x + m21 * y + m22 * z
    for i in range(count):
        value, gx, gy, gz = tap_tile(
            tile, w[slot + N + i], w[slot + 2 * N + i], w[slot + 3 * N + i], False
        )
        w[slot + i] = value
        w[slot + N + i] = gx
        w[slot + 2 * N + i] = gy
        w[slot + 3 * N + i] = gz
    for i in range(N):
        gx = w[slot + N + i]
        gy = w[slot + 2 * N + i]
        gz = w[slot + 3 * N + i]
        w[slot + N + i] = m00 * gx + m10 * gy + m20 * gz
        w[slot + 2 * N + i] = m01 * gx + m11 * gy + m21 * gz
        w[slot + 3 * N + i] = m02 * gx + m12 * gy + m22 * gz


@njit(cache=True, nogil=True, error_model="numpy")
def mottle_and_large_vessels(
    w: Floats,
    count: int,
    tile: Floats,
    to_tile: Floats,
    offsets: Floats,
    eye_mm: Floats,
) -> None:
    """Mottle a block's blood codes by two octaves; add the large vessels.

    What full detail does, without its finest octave and vessels, and as vector code.
    Uses the short octave's slots.
    """
    m00, m01, m02 = to_tile[3, 0, 0], to_tile[3, 0, 1], to_tile[3, 0, 2]
    m10, m11, m12 = to_tile[3, 1, 0], to_tile[3, 1, 1], to_tile[3, 1, 2]
    m20, m21, m22 = to_tile[3, 2, 0], to_tile[3, 2, 1], to_tile[3, 2, 2]
    ex, ey, ez = eye_mm[0], eye_mm[1], eye_mm[2]
    ox, oy, oz = offsets[0, 0], offsets[0, 1], offsets[0, 2]
    for i in range(N):
        bend = f32(0.22) * w[MIDDLE + i]
        x = ex + w[PX + i] + ox + bend
        y = ey + w[PY + i] + oy
        z = ez + w[PZ + i] + oz + bend
        w[SHORT + N + i] = m00 * x + m01 * y + m02 * z
        w[SHORT + 2 * N + i] = m10 * x + m11 * y + m12 * z
        w[SHORT + 3 * N + i] = m20 * x + m21 * y + m22 * z
    for i in range(count):
        value, gx, gy, gz = tap_tile(
            tile, w[SHORT + N + i], w[SHORT + 2 * N + i], w[SHORT + 3 * N + i], True
        )
        w[SHORT + i] = value
        w[SHORT + N + i] = gx
        w[SHORT + 2 * N + i] = gy
        w[SHORT + 3 * N + i] = gz
    for i in range(N):
        a = w[SHORT + N + i]
        b = w[SHORT + 2 * N + i]
        c = w[SHORT + 3 * N + i]
        gx = m00 * a + m10 * b + m20 * c
        gy = m01 * a + m11 * b + m21 * c
        gz = m02 * a + m12 * b + m22 * c
        d = gx * w[NX + i] + gy * w[NY + i] + gz * w[NZ + i]
        slope = math.sqrt(max(gx * gx + gy * gy + gz * gz - d * d, f32(1e-12)))
        radius = f32(0.042) * (f32(0.55) + f32(0.45) * w[LONG + i])
        edge = f32(0.55) * radius + f32(0.02)
        thin = f32(0.7) * w[FOOT + i]
        soft = max(edge, thin)
        cover = f32(1) - ramp(radius - soft, radius + soft, abs(w[SHORT + i]) / slope)
        cover *= f32(0.6) * min(f32(1), radius / thin)
        cover = cover if slope > f32(0.12) else f32(0)
        cover = cover if radius > f32(0) else f32(0)
        w2 = f32(1) - ramp(f32(0.25), f32(0.5), w[FOOT + i] * f32(1 / 1.6))
        mottle = MOTTLE_LONG * w[LONG + i] + MOTTLE_MIDDLE * w2 * w[MIDDLE + i]
        blood = w[CODE + i] * w[CODE + i] * f32(1 / 65025)
        # no tile reaches 7 standard deviations: shift by 4 to stay below zero
        blood *= f32(E_TO_4) * exp_negative(mottle - f32(4))
        blood += cover * (f32(1) - w[SKIN + i]) * (f32(0.10) + f32(1.6) * blood)
        w[CODE + i] = math.sqrt(min(blood, f32(1))) * f32(255)


@njit(cache=True, nogil=True, error_model="numpy")
def paint(
    w: Floats,
    count: int,
    tint: NDArray[np.uint16],
    shape: tuple[int, int, int],
    blood_bias: np.float32,
    colours: Floats,
    skin_colour: Floats,
    full: bool,
    tile: Floats,
    vessel_tile: Floats,
    to_tile: Floats,
    offsets: Floats,
    eye_mm: Floats,
) -> None:
    """Find albedo, scattering, film and the two bumped normals of a block.

    colours: flat, 256 rows of eight floats of which five count.
    """
    bias_root = f32(math.sqrt(blood_bias))
    for i in range(count):
        code, skin = tint_at(tint, shape, w[UX + i], w[UY + i], w[UZ + i])
        w[CODE + i] = code
        w[SKIN + i] = skin
    for i in range(N):
        w[CODE + i] *= bias_root
        w[SKIN + i] *= w[SHARE + i] * f32(1 / 255)
    tap_octave(w, count, tile, to_tile, 0, eye_mm, LONG)
    tap_octave(w, count, tile, to_tile, 1, eye_mm, MIDDLE)
    if full:
        tap_octave(w, count, tile, to_tile, 2, eye_mm, SHORT)
        for i in range(count):
            w[CODE + i] = mottled_code(w, i, vessel_tile, to_tile, offsets, eye_mm)
        bump(w, f32(1), f32(1))
    else:
        mottle_and_large_vessels(w, count, vessel_tile, to_tile, offsets, eye_mm)
        for i in range(N):
            w[SHORT + N + i] = f32(0)
            w[SHORT + 2 * N + i] = f32(0)
            w[SHORT + 3 * N + i] = f32(0)
        bump(w, f32(1), f32(0))
    for i in range(count):
        u = min(w[CODE + i], f32(254.999))
        n = np.int64(u)
        u -= f32(n)
        red, green, blue, length = rows2(colours, 8 * n, 8 * n + 8, u)
        w[RED + i] = red
        w[GREEN + i] = green
        w[BLUE + i] = blue
        w[LR + i] = length
        low = colours[8 * n + 4]
        w[LG + i] = low + u * (colours[8 * n + 12] - low)
    skin_red, skin_green, skin_blue = skin_colour[0], skin_colour[1], skin_colour[2]
    for i in range(N):
        skin = w[SKIN + i]
        share = w[SHARE + i]
        red = w[RED + i] + skin * (skin_red - w[RED + i])
        green = w[GREEN + i] + skin * (skin_green - w[GREEN + i])
        blue = w[BLUE + i] + skin * (skin_blue - w[BLUE + i])
        w[RED + i] = share * red + w[ADD_RED + i]
        w[GREEN + i] = share * green + w[ADD_GREEN + i]
        w[BLUE + i] = share * blue + w[ADD_BLUE + i]
        w[LR + i] = share * w[LR + i] + w[ADD_LR + i]
        w[LG + i] = share * w[LG + i] + w[ADD_LG + i]


@njit(cache=True, nogil=True, error_model="numpy")
def mottled_code(
    w: Floats,
    i: int,
    vessel_tile: Floats,
    to_tile: Floats,
    offsets: Floats,
    eye_mm: Floats,
) -> np.float32:
    """Give pixel i's blood code after mottle and vessels."""
    foot = w[FOOT + i]
    m1 = w[LONG + i]
    m2 = w[MIDDLE + i]
    m3 = w[SHORT + i]
    w2 = f32(1) - ramp(f32(0.25), f32(0.5), foot * f32(1 / 1.6))
    w3 = f32(1) - ramp(f32(0.25), f32(0.5), foot * f32(1 / 0.55))
    mottle = MOTTLE_LONG * m1 + MOTTLE_MIDDLE * w2 * m2 + MOTTLE_SHORT * w3 * m3
    blood = w[CODE + i] * w[CODE + i] * f32(1 / 65025) * f32(math.exp(mottle))
    blood = with_vessels(
        blood,
        w[SKIN + i],
        eye_mm[0] + w[PX + i],
        eye_mm[1] + w[PY + i],
        eye_mm[2] + w[PZ + i],
        w[NX + i],
        w[NY + i],
        w[NZ + i],
        m1,
        m2,
        m3,
        foot,
        vessel_tile,
        to_tile,
        offsets,
    )
    code: np.float32 = f32(math.sqrt(min(blood, f32(1)))) * f32(255)
    return code
