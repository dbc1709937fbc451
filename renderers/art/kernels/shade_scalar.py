"""Shade a sample, one ray at a time; `vector.shading` does it lane by lane."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.art.kernels.opacity_scalar import ONE, ZERO, power

TINY = np.float32(1e-6)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def light_up(
    lights: NDArray[np.float32], material: NDArray[np.float32],
    least_gradient: np.float32, r: np.float32, g: np.float32, b: np.float32,
    gx: np.float32, gy: np.float32, gz: np.float32,
    x: np.float32, y: np.float32, z: np.float32,
    vx: np.float32, vy: np.float32, vz: np.float32,
) -> tuple[np.float32, np.float32, np.float32]:  # fmt: skip
    """Give a colour under lights, or as it is where a gradient is too small.

    lights, material: as `march_classic` takes them. gx, gy, gz: the gradient. x, y, z:
    the sample's place, mm along the array's axes. vx, vy, vz: the ray's direction.
    """
    steep = math.sqrt(gx * gx + gy * gy + gz * gz)
    if not steep > least_gradient:
        return r, g, b
    inverse = -ONE / steep
    nx, ny, nz = gx * inverse, gy * inverse, gz * inverse
    dr, dg, db = material[0], material[0], material[0]
    er, eg, eb = ZERO, ZERO, ZERO
    for m in range(len(lights)):
        qx, qy, qz = lights[m, 0], lights[m, 1], lights[m, 2]
        if lights[m, 9] > ZERO:
            qx, qy, qz = qx - x, qy - y, qz - z
            way_mm = np.float32(math.sqrt(qx * qx + qy * qy + qz * qz))
            per_way = ONE / (way_mm if way_mm > TINY else TINY)
            qx, qy, qz = qx * per_way, qy * per_way, qz * per_way
        c = max(nx * qx + ny * qy + nz * qz, ZERO)
        dr += c * lights[m, 3]
        dg += c * lights[m, 4]
        db += c * lights[m, 5]
        if material[1] > ZERO:
            hx, hy, hz = qx - vx, qy - vy, qz - vz
            q = max(math.sqrt(hx * hx + hy * hy + hz * hz), TINY)
            c = max((nx * hx + ny * hy + nz * hz) / q, ZERO)
            c = power(c, material[2])
            er += c * lights[m, 6]
            eg += c * lights[m, 7]
            eb += c * lights[m, 8]
    return r * dr + er, g * dg + eg, b * db + eb
