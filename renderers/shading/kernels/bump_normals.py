"""Compiled: the tissue's and the film's normals of a block of pixels."""

import math

from numba import njit

import renderers.shading.kernels.pixel_block as block
from renderers.shading.kernels.elementary import Three, load3, resolved, store3
from renderers.shading.kernels.pixel_block import N
from renderers.simd import load, maximum, sqrt, store
from renderers.simd.arrays import Floats, Lanes, f32

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
def bent(nx: Lanes, ny: Lanes, nz: Lanes, gx: Lanes, gy: Lanes, gz: Lanes) -> Three:
    """Bend a normal against the tangential part of a gradient."""
    along = gx * nx + gy * ny + gz * nz
    x = nx - (gx - along * nx)
    y = ny - (gy - along * ny)
    z = nz - (gz - along * nz)
    k = f32(1) / sqrt(x * x + y * y + z * z + f32(1e-20))
    return x * k, y * k, z * k


@njit(cache=True, nogil=True, error_model="numpy")
def bump(w: Floats, short: bool) -> None:
    """Bend the tissue's and the film's normal by the octaves' tangential gradients.

    Waves too fine for a pixel (and the short octave, if `short` is not set) become
    roughness instead.
    """
    nx, ny, nz = load3(w, block.NX)
    relief = load(w, block.RELIEF, N)
    foot = load(w, block.FOOT, N)
    w2 = resolved(foot, f32(1 / 1.6))
    rough = VARIANCE_MIDDLE * (f32(1) - w2 * w2)
    gx, gy, gz = load3(w, block.MIDDLE + N)
    s2 = relief * TISSUE_MIDDLE * w2
    ax, ay, az = s2 * gx, s2 * gy, s2 * gz
    s1 = relief * FILM_LONG
    s2 = relief * FILM_MIDDLE * w2
    bx = s1 * load(w, block.LONG + N, N) + s2 * gx
    by = s1 * load(w, block.LONG + 2 * N, N) + s2 * gy
    bz = s1 * load(w, block.LONG + 3 * N, N) + s2 * gz
    if short:
        w3 = resolved(foot, f32(1 / 0.55))
        rough += VARIANCE_SHORT * (f32(1) - w3 * w3)
        gx, gy, gz = load3(w, block.SHORT + N)
        s3 = relief * TISSUE_SHORT * w3
        ax += s3 * gx
        ay += s3 * gy
        az += s3 * gz
        s3 = relief * FILM_SHORT * w3
        bx += s3 * gx
        by += s3 * gy
        bz += s3 * gz
    else:
        rough += VARIANCE_SHORT
    tx, ty, tz = bent(nx, ny, nz, ax, ay, az)
    store3(w, block.TX, tx, ty, tz)
    hx, hy, hz = bent(nx, ny, nz, bx, by, bz)
    store3(w, block.HX, hx, hy, hz)
    a2 = load(w, block.ROUGH, N) + relief * relief * rough
    a2 += load(w, block.SKIN, N) * maximum(f32(0.12) - a2, f32(0))
    store(w, block.A2, a2)
