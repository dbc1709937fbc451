"""Compiled: the tissue's and the film's normals of a block of pixels."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.shading.detail.kernels import ramp
from renderers.shading.surface.block import (
    A2,
    FOOT,
    HX,
    HY,
    HZ,
    LONG,
    MIDDLE,
    NX,
    NY,
    NZ,
    RELIEF,
    SHORT,
    SKIN,
    TX,
    TY,
    TZ,
    N,
)

f32 = np.float32
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
def bump(w: Floats, middle_part: np.float32, short_part: np.float32) -> None:
    """Bend the tissue's and the film's normal by the octaves' tangential gradients.

    Waves too fine for a pixel (or a part of 0) become roughness instead.
    """
    for i in range(N):
        nx = w[NX + i]
        ny = w[NY + i]
        nz = w[NZ + i]
        relief = w[RELIEF + i]
        foot = w[FOOT + i]
        w2 = middle_part - middle_part * ramp(f32(0.25), f32(0.5), foot * f32(1 / 1.6))
        w3 = short_part - short_part * ramp(f32(0.25), f32(0.5), foot * f32(1 / 0.55))
        rough = VARIANCE_MIDDLE * (f32(1) - w2 * w2)
        rough += VARIANCE_SHORT * (f32(1) - w3 * w3)
        s1 = relief * FILM_LONG
        s2 = relief * FILM_MIDDLE * w2
        s3 = relief * FILM_SHORT * w3
        gx = s1 * w[LONG + N + i] + s2 * w[MIDDLE + N + i] + s3 * w[SHORT + N + i]
        gy = s1 * w[LONG + 2 * N + i] + s2 * w[MIDDLE + 2 * N + i]
        gz = s1 * w[LONG + 3 * N + i] + s2 * w[MIDDLE + 3 * N + i]
        gy += s3 * w[SHORT + 2 * N + i]
        gz += s3 * w[SHORT + 3 * N + i]
        along = gx * nx + gy * ny + gz * nz
        hx = nx - (gx - along * nx)
        hy = ny - (gy - along * ny)
        hz = nz - (gz - along * nz)
        k = f32(1) / math.sqrt(hx * hx + hy * hy + hz * hz + f32(1e-20))
        w[HX + i] = hx * k
        w[HY + i] = hy * k
        w[HZ + i] = hz * k
        s2 = relief * TISSUE_MIDDLE * w2
        s3 = relief * TISSUE_SHORT * w3
        gx = s2 * w[MIDDLE + N + i] + s3 * w[SHORT + N + i]
        gy = s2 * w[MIDDLE + 2 * N + i] + s3 * w[SHORT + 2 * N + i]
        gz = s2 * w[MIDDLE + 3 * N + i] + s3 * w[SHORT + 3 * N + i]
        along = gx * nx + gy * ny + gz * nz
        tx = nx - (gx - along * nx)
        ty = ny - (gy - along * ny)
        tz = nz - (gz - along * nz)
        k = f32(1) / math.sqrt(tx * tx + ty * ty + tz * tz + f32(1e-20))
        w[TX + i] = tx * k
        w[TY + i] = ty * k
        w[TZ + i] = tz * k
        a2 = w[A2 + i] + relief * relief * rough
        w[A2 + i] = a2 + w[SKIN + i] * max(f32(0.12) - a2, f32(0))
