"""Compiled: albedo, scattering, film and bumped normals of a block of pixels.

Positions are millimetres, voxel coordinates count along the array's x, y, z.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

import renderers.shading.kernels.pixel_block as block
from renderers.shading.kernels.bump_normals import bump
from renderers.shading.kernels.pixel_block import ROWS, N, W
from renderers.shading.kernels.surface_noise import (
    NoiseTile,
    locate,
    mottle,
    tap,
    tap_octave,
    turn,
)
from renderers.simd import (
    any_,
    full,
    gather_pairs,
    load,
    maximum,
    minimum,
    rows4,
    store,
)
from renderers.simd import f32 as to_real
from renderers.simd import i32 as to_whole
from renderers.simd.arrays import Bytes, Floats, Lanes, f32, i32


class SurfaceTables(NamedTuple):
    """What the look of a surface is made from.

    tint: flat, blood code + 256 * skin code. colours: `colour_table` as flat rows of
    eight floats. skin: ``(3,)`` linear albedo. materials: see `material_table`. tile,
    vessel_tile: noise of mottle and ripples, and of vessels. to_tile: ``(5, 3, 3)`` mm
    to tile voxels: three octaves of mottle, two of vessels. offsets: ``(2, 3)`` mm that
    keep vessels from following the mottle. blood_bias: factor on all blood content.
    full_detail: with the short octave and the small vessels.
    """

    tint: NDArray[np.uint16]
    colours: Floats
    skin: Floats
    materials: Floats
    tile: NoiseTile
    vessel_tile: NoiseTile
    to_tile: Floats
    offsets: Floats
    blood_bias: np.float32
    full_detail: bool


@njit(cache=True, nogil=True, error_model="numpy")
def between(a: Lanes, b: Lanes, t: Lanes) -> Lanes:
    """Interpolate from `a` to `b`."""
    return a + t * (b - a)


@njit(cache=True, nogil=True, error_model="numpy")
def blend(
    c0: Lanes, c1: Lanes, c2: Lanes, c3: Lanes, low: int, x: Lanes, y: Lanes, z: Lanes
) -> Lanes:
    """Interpolate the bytes at bit `low` of four rows, and those 16 bits above."""
    left0 = to_real((c0 >> low) & 255)
    left1 = to_real((c1 >> low) & 255)
    left2 = to_real((c2 >> low) & 255)
    left3 = to_real((c3 >> low) & 255)
    left = between(between(left0, left1, y), between(left2, left3, y), z)
    left0 = to_real((c0 >> (low + 16)) & 255)
    left1 = to_real((c1 >> (low + 16)) & 255)
    left2 = to_real((c2 >> (low + 16)) & 255)
    left3 = to_real((c3 >> (low + 16)) & 255)
    right = between(between(left0, left1, y), between(left2, left3, y), z)
    return between(left, right, x)


@njit(cache=True, nogil=True, error_model="numpy")
def tint_at(w: Floats, tint: NDArray[np.uint16], shape: tuple[int, int, int]) -> bool:
    """Interpolate a block's blood and skin codes, 0..255; say if there is skin."""
    nz, ny, nx = shape
    row = i32(nx)
    layer = i32(nx * ny)
    most_x = f32(nx) - f32(1.001)
    most_y = f32(ny) - f32(1.001)
    most_z = f32(nz) - f32(1.001)
    any_skin = False
    for i in range(0, N, W):
        x = minimum(maximum(load(w, block.UX + i, W), f32(0)), most_x)
        y = minimum(maximum(load(w, block.UY + i, W), f32(0)), most_y)
        z = minimum(maximum(load(w, block.UZ + i, W), f32(0)), most_z)
        a = to_whole(x)
        b = to_whole(y)
        c = to_whole(z)
        x -= to_real(a)
        y -= to_real(b)
        z -= to_real(c)
        at = a + b * row + c * layer
        c0 = gather_pairs(tint, at)
        c1 = gather_pairs(tint, at + row)
        c2 = gather_pairs(tint, at + layer)
        c3 = gather_pairs(tint, at + (row + layer))
        store(w, block.CODE + i, blend(c0, c1, c2, c3, 0, x, y, z))
        # low byte blood, high byte skin, of two voxels; most tissue has no skin
        if any_(((c0 | c1 | c2 | c3) & i32(-16711936)) != 0):
            any_skin = True
            store(w, block.SKIN + i, blend(c0, c1, c2, c3, 8, x, y, z))
        else:
            store(w, block.SKIN + i, full(f32(0), W))
    return any_skin


@njit(cache=True, nogil=True, error_model="numpy")
def set_tissue(w: Floats, materials: Floats) -> None:
    """Make a block all tissue."""
    a2 = materials[0, 5] * materials[0, 5]
    for i in range(N):
        w[block.SHARE + i] = f32(1)
        w[block.RELIEF + i] = f32(1)
        w[block.F0 + i] = materials[0, 4]
        w[block.ROUGH + i] = a2
        w[block.ADD_RED + i] = f32(0)
        w[block.ADD_GREEN + i] = f32(0)
        w[block.ADD_BLUE + i] = f32(0)
        w[block.ADD_LR + i] = f32(0)
        w[block.ADD_LG + i] = f32(0)


@njit(cache=True, nogil=True, error_model="numpy")
def set_materials(
    w: Floats,
    material: Bytes,
    y0: int,
    x0: int,
    first: int,
    last: int,
    materials: Floats,
    mixed: bool,
) -> bool:
    """Spread the material table over a block; say whether it holds more than tissue.

    Rows outside ``first..last`` are tissue. mixed: what the block was before; all
    tissue upon all tissue needs no work.
    """
    width = material.shape[1]
    count = min(W, width - x0)
    kinds = 0
    for y in range(max(y0, first), min(y0 + ROWS, last)):
        if count == W:
            if any_(load(material, y * width + x0, W) != 0):
                kinds = 1
        else:
            for x in range(x0, width):
                kinds |= material[y, x]
    if mixed:
        set_tissue(w, materials)
    if kinds == 0:
        return False
    for y in range(max(y0, first), min(y0 + ROWS, last)):
        for x in range(x0, x0 + count):
            i = (y - y0) * W + x - x0
            m = np.int64(material[y, x])
            w[block.SHARE + i] = materials[m, 0]
            w[block.ADD_RED + i] = materials[m, 1]
            w[block.ADD_GREEN + i] = materials[m, 2]
            w[block.ADD_BLUE + i] = materials[m, 3]
            w[block.F0 + i] = materials[m, 4]
            w[block.ROUGH + i] = materials[m, 5] * materials[m, 5]
            w[block.RELIEF + i] = materials[m, 6]
            w[block.ADD_LR + i] = materials[m, 7]
            w[block.ADD_LG + i] = materials[m, 8]
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def colour(w: Floats, colours: Floats) -> None:
    """Look a block's blood codes up in the table: albedo and diffusion lengths.

    colours: flat, 256 rows of eight floats: red, green, blue, length of red light,
    of green light, and that of the next row.
    """
    here = colours[0:]
    lengths = colours[4:]
    after = colours[8:]
    for i in range(0, N, W):
        u = minimum(load(w, block.CODE + i, W), f32(254.999))
        n = to_whole(u)
        u -= to_real(n)
        # rows of four floats, two to a code
        n += n
        r0, g0, b0, l0 = rows4(here, n)
        r1, g1, b1, l1 = rows4(after, n)
        m0, m1, _, _ = rows4(lengths, n)
        store(w, block.RED + i, between(r0, r1, u))
        store(w, block.GREEN + i, between(g0, g1, u))
        store(w, block.BLUE + i, between(b0, b1, u))
        store(w, block.LR + i, between(l0, l1, u))
        store(w, block.LG + i, between(m0, m1, u))


@njit(cache=True, nogil=True, error_model="numpy")
def mix(w: Floats, skin_colour: Floats) -> None:
    """Mix skin and other materials into a block's tissue."""
    skin_red, skin_green, skin_blue = skin_colour[0], skin_colour[1], skin_colour[2]
    skin = load(w, block.SKIN, N)
    share = load(w, block.SHARE, N)
    red = load(w, block.RED, N)
    green = load(w, block.GREEN, N)
    blue = load(w, block.BLUE, N)
    red = share * (red + skin * (skin_red - red))
    green = share * (green + skin * (skin_green - green))
    blue = share * (blue + skin * (skin_blue - blue))
    store(w, block.RED, red + load(w, block.ADD_RED, N))
    store(w, block.GREEN, green + load(w, block.ADD_GREEN, N))
    store(w, block.BLUE, blue + load(w, block.ADD_BLUE, N))
    store(w, block.LR, share * load(w, block.LR, N) + load(w, block.ADD_LR, N))
    store(w, block.LG, share * load(w, block.LG, N) + load(w, block.ADD_LG, N))


@njit(cache=True, nogil=True, error_model="numpy")
def find_surface(
    w: Floats,
    mixed: bool,
    surface: SurfaceTables,
    shape: tuple[int, int, int],
    eye_mm: Floats,
) -> None:
    """Find albedo, scattering, film and the two bumped normals of a block.

    mixed: whether there is more than tissue in it. shape: of the volume of tints.
    eye_mm: the eye seen from the volume's centre.
    """
    tint, colours, skin_colour, _, tile, vessel_tile, to_tile, offsets, _, _ = surface
    blood_bias, full_detail = surface.blood_bias, surface.full_detail
    bias_root = f32(math.sqrt(blood_bias))
    x, y, z = eye_mm[0], eye_mm[1], eye_mm[2]
    at = (x, y, z)
    locate(w, to_tile, 0, at, False, block.LONG)
    locate(w, to_tile, 1, at, False, block.MIDDLE)
    skin = tint_at(w, tint, shape)
    store(w, block.CODE, load(w, block.CODE, N) * bias_root)
    share = load(w, block.SHARE, N)
    store(w, block.SKIN, load(w, block.SKIN, N) * share * f32(1 / 255))
    tap(w, tile.quads, block.LONG)
    tap(w, tile.quads, block.MIDDLE)
    turn(w, tile.unit, to_tile, 0, block.LONG)
    turn(w, tile.unit, to_tile, 1, block.MIDDLE)
    at = (x + offsets[0, 0], y + offsets[0, 1], z + offsets[0, 2])
    tap_octave(w, vessel_tile, to_tile, 3, at, True, block.LARGE)
    if full_detail:
        at = (x, y, z)
        tap_octave(w, tile, to_tile, 2, at, False, block.SHORT)
        at = (x + offsets[1, 0], y + offsets[1, 1], z + offsets[1, 2])
        tap_octave(w, vessel_tile, to_tile, 4, at, True, block.SMALL)
    mottle(w, full_detail)
    bump(w, full_detail)
    colour(w, colours)
    if skin or mixed:
        mix(w, skin_colour)
