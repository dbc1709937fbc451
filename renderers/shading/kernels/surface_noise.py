"""Compiled: taps into noise tiles, mottle and vessels of a block of pixels.

Coordinates are millimetres relative to the volume's centre, world axes, so that
float32 keeps a micrometre everywhere.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit

import renderers.shading.kernels.pixel_block as block
from renderers.shading.kernels.elementary import exp_negative, load3, resolved, smooth
from renderers.shading.kernels.pixel_block import N, W
from renderers.simd import (
    absolute,
    as_f32,
    as_i32,
    cell4,
    floor,
    load,
    maximum,
    minimum,
    select,
    sqrt,
    store,
)
from renderers.simd import i32 as to_whole
from renderers.simd.arrays import Floats, Lanes, Shorts, f32

MOTTLE_LONG = f32(0.26)
MOTTLE_MIDDLE = f32(0.11)
MOTTLE_SHORT = f32(0.07)
"""Standard deviations of log blood content on the three octaves."""

CELL_SCALE = 32767
"""What `cell4` multiplies by."""
E_TO_4 = f32(math.exp(4))
TILE_SIZE = 64
"""Voxels along an edge of a tile; a power of two, so that wrapping is a bit mask."""
WRAP = TILE_SIZE - 1
ROW = TILE_SIZE + 1
SLICE = ROW * ROW
"""Voxels from one row and one slice of a stored tile to the next: it ends with its
beginning again, so that no corner of a cell needs wrapping."""


class NoiseTile(NamedTuple):
    """A tile stored for taps of whole cells.

    quads: flat int16, ``65**3`` voxels of value and three derivatives. unit: what one
    of them counts (about 2e-4).
    """

    quads: Shorts
    unit: np.float32


@njit(cache=True, nogil=True, error_model="numpy")
def locate(
    w: Floats,
    to_tile: Floats,
    which: int,
    origin: tuple[np.float32, np.float32, np.float32],
    eased: bool,
    slot: int,
) -> None:
    """Find the tile cells of a block's points: number and fractions at `slot`.

    to_tile: ``(n, 3, 3)``, of which matrix `which` maps millimetres to tile voxels.
    origin: mm, the points' zero. eased: smooth the interpolation; zero curves of a
    plainly trilinear field are visibly polygons.
    """
    m00, m01, m02 = to_tile[which, 0, 0], to_tile[which, 0, 1], to_tile[which, 0, 2]
    m10, m11, m12 = to_tile[which, 1, 0], to_tile[which, 1, 1], to_tile[which, 1, 2]
    m20, m21, m22 = to_tile[which, 2, 0], to_tile[which, 2, 1], to_tile[which, 2, 2]
    ox, oy, oz = origin
    x = ox + load(w, block.PX, N)
    y = oy + load(w, block.PY, N)
    z = oz + load(w, block.PZ, N)
    if eased:
        # vessels
        if which == 3:
            bend = f32(0.22) * load(w, block.MIDDLE, N)
            x += bend
        else:
            bend = f32(0.05) * load(w, block.SHORT, N)
            y += bend
        z += bend
    a = m00 * x + m01 * y + m02 * z
    b = m10 * x + m11 * y + m12 * z
    c = m20 * x + m21 * y + m22 * z
    i0 = floor(a)
    j0 = floor(b)
    k0 = floor(c)
    a -= i0
    b -= j0
    c -= k0
    if eased:
        a = smooth(a)
        b = smooth(b)
        c = smooth(c)
    cell = (to_whole(i0) & WRAP) + (to_whole(j0) & WRAP) * ROW
    cell += (to_whole(k0) & WRAP) * SLICE
    store(w, slot, as_f32(cell))
    store(w, slot + N, a)
    store(w, slot + 2 * N, b)
    store(w, slot + 3 * N, c)


@njit(cache=True, nogil=True, error_model="numpy")
def tap(w: Floats, tile: Shorts, slot: int) -> None:
    """Replace cells and fractions at `slot` by the tile's four channels there."""
    for i in range(0, N, W):
        cell = as_i32(load(w, slot + i, W))
        x = load(w, slot + N + i, W)
        y = load(w, slot + 2 * N + i, W)
        z = load(w, slot + 3 * N + i, W)
        value, gx, gy, gz = cell4(tile, cell, ROW, SLICE, x, y, z)
        store(w, slot + i, value)
        store(w, slot + N + i, gx)
        store(w, slot + 2 * N + i, gy)
        store(w, slot + 3 * N + i, gz)


@njit(cache=True, nogil=True, error_model="numpy")
def turn(w: Floats, unit: np.float32, to_tile: Floats, which: int, slot: int) -> None:
    """Give tapped channels their unit: sd, and sd per mm along the world's axes."""
    s = unit * f32(1 / CELL_SCALE)
    m00, m01, m02 = to_tile[which, 0, 0], to_tile[which, 0, 1], to_tile[which, 0, 2]
    m10, m11, m12 = to_tile[which, 1, 0], to_tile[which, 1, 1], to_tile[which, 1, 2]
    m20, m21, m22 = to_tile[which, 2, 0], to_tile[which, 2, 1], to_tile[which, 2, 2]
    m00, m01, m02 = s * m00, s * m01, s * m02
    m10, m11, m12 = s * m10, s * m11, s * m12
    m20, m21, m22 = s * m20, s * m21, s * m22
    gx, gy, gz = load3(w, slot + N)
    store(w, slot, s * load(w, slot, N))
    store(w, slot + N, m00 * gx + m10 * gy + m20 * gz)
    store(w, slot + 2 * N, m01 * gx + m11 * gy + m21 * gz)
    store(w, slot + 3 * N, m02 * gx + m12 * gy + m22 * gz)


@njit(cache=True, nogil=True, error_model="numpy")
def tap_octave(
    w: Floats,
    tile: NoiseTile,
    to_tile: Floats,
    which: int,
    origin: tuple[np.float32, np.float32, np.float32],
    eased: bool,
    slot: int,
) -> None:
    """Tap an octave at a block's points: value and gradient per mm at `slot`."""
    locate(w, to_tile, which, origin, eased, slot)
    tap(w, tile.quads, slot)
    turn(w, tile.unit, to_tile, which, slot)


@njit(cache=True, nogil=True, error_model="numpy")
def vessel(
    value: Lanes,
    slope: Lanes,
    radius: Lanes,
    edge: Lanes,
    footprint: Lanes,
    flattest: np.float32,
) -> Lanes:
    """Return the cover 0..1 of a vessel that follows the zero curve of a noise.

    value, slope: noise at the point and the length of its tangential gradient, 1/mm;
    their ratio is the distance to the curve in mm, so the width does not swell where
    the noise is flat. radius, edge: mm. footprint: mm a pixel covers; a vessel
    thinner than that fades instead of flickering. flattest: below this slope the
    zero set is a blot and not a curve.
    """
    thin = f32(0.7) * footprint
    soft = maximum(edge, thin)
    width = f32(2) * soft * slope
    # one division for two quotients
    k = f32(1) / (width * thin)
    outside = (absolute(value) - (radius - soft) * slope) * thin * k
    outside = minimum(maximum(outside, f32(0)), f32(1))
    cover = (f32(1) - smooth(outside)) * minimum(radius * width * k, f32(1))
    return select((radius > f32(0)) & (slope > flattest), cover, f32(0))


@njit(cache=True, nogil=True, error_model="numpy")
def across(nx: Lanes, ny: Lanes, nz: Lanes, gx: Lanes, gy: Lanes, gz: Lanes) -> Lanes:
    """Return the length of a gradient's tangential part."""
    d = gx * nx + gy * ny + gz * nz
    return sqrt(maximum(gx * gx + gy * gy + gz * gz - d * d, f32(1e-12)))


@njit(cache=True, nogil=True, error_model="numpy")
def mottle(w: Floats, full_detail: bool) -> None:
    """Vary a block's blood codes by the octaves' values and add the tapped vessels.

    full_detail: with the short octave and the small vessels.
    """
    nx, ny, nz = load3(w, block.NX)
    foot = load(w, block.FOOT, N)
    m1 = load(w, block.LONG, N)
    m2 = load(w, block.MIDDLE, N)
    slope = across(nx, ny, nz, *load3(w, block.LARGE + N))
    radius = f32(0.042) * (f32(0.55) + f32(0.45) * m1)
    edge = f32(0.55) * radius + f32(0.02)
    value = load(w, block.LARGE, N)
    cover = f32(0.6) * vessel(value, slope, radius, edge, foot, f32(0.12))
    log_blood = MOTTLE_LONG * m1 + MOTTLE_MIDDLE * resolved(foot, f32(1 / 1.6)) * m2
    if full_detail:
        slope = across(nx, ny, nz, *load3(w, block.SMALL + N))
        radius = f32(0.022) * (f32(0.5) + f32(0.6) * m2)
        edge = f32(0.6) * radius + f32(0.015)
        value = load(w, block.SMALL, N)
        fine = f32(0.45) * vessel(value, slope, radius, edge, foot, f32(0.35))
        cover = maximum(cover, fine)
        m3 = load(w, block.SHORT, N)
        log_blood += MOTTLE_SHORT * resolved(foot, f32(1 / 0.55)) * m3
    code = load(w, block.CODE, N)
    # no tile reaches 7 standard deviations: shift by 4 to stay below zero
    blood = code * code * (E_TO_4 * f32(1 / 65025)) * exp_negative(log_blood - f32(4))
    skin = load(w, block.SKIN, N)
    blood += cover * (f32(1) - skin) * (f32(0.10) + f32(1.6) * blood)
    store(w, block.CODE, sqrt(minimum(blood, f32(1))) * f32(255))
