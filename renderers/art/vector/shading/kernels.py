"""Shade samples lane by lane: the steps of `renderers.art.lighting`."""

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.art.lighting.kernels import TINY
from renderers.art.optics.kernels import ONE, ZERO
from renderers.art.vector.optics.kernels import power
from renderers.simd import maximum, select, sqrt

Lanes = Any
"""A vector of `renderers.simd`."""

F32 = NDArray[np.float32]


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def unit(x: Lanes, y: Lanes, z: Lanes) -> tuple[Lanes, Lanes, Lanes]:
    """Give vectors of length one."""
    scale = ONE / maximum(sqrt(x * x + y * y + z * z), TINY)
    return x * scale, y * scale, z * scale


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def light_up(
    lights: F32, material: F32, least_gradient: np.float32, zero: Lanes,
    r: Lanes, g: Lanes, b: Lanes, gx: Lanes, gy: Lanes, gz: Lanes,
    x: Lanes, y: Lanes, z: Lanes,
    vx: Lanes, vy: Lanes, vz: Lanes,
) -> tuple[Lanes, Lanes, Lanes]:  # fmt: skip
    """Give colours under lights, but where a gradient is too small for a normal.

    lights, material: as the scalar march has them. x, y, z: the samples' places, mm
    along the array's axes. zero: zeros. vx, vy, vz: directions of the rays.
    """
    steep = sqrt(gx * gx + gy * gy + gz * gz)
    inverse = -ONE / steep
    nx, ny, nz = gx * inverse, gy * inverse, gz * inverse
    dr = zero + material[0]
    dg, db, er, eg, eb = dr, dr, zero, zero, zero
    for m in range(len(lights)):
        qx, qy, qz = zero + lights[m, 0], zero + lights[m, 1], zero + lights[m, 2]
        if lights[m, 9] > ZERO:
            qx, qy, qz = unit(qx - x, qy - y, qz - z)
        c = maximum(nx * qx + ny * qy + nz * qz, ZERO)
        dr += c * lights[m, 3]
        dg += c * lights[m, 4]
        db += c * lights[m, 5]
        if material[1] > ZERO:
            hx, hy, hz = qx - vx, qy - vy, qz - vz
            q = maximum(sqrt(hx * hx + hy * hy + hz * hz), TINY)
            c = maximum((nx * hx + ny * hy + nz * hz) / q, ZERO)
            c = power(c, material[2])
            er += c * lights[m, 6]
            eg += c * lights[m, 7]
            eb += c * lights[m, 8]
    lit = steep > least_gradient
    r = select(lit, r * dr + er, r)
    g = select(lit, g * dg + eg, g)
    return r, g, select(lit, b * db + eb, b)
