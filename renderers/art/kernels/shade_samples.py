"""Shade samples lane by lane, by Blinn and Phong.

A colour under lights is ``colour * (ambient + sum diffuse (n . l)) + sum specular
(n . h)**shininess``, with the normal n against the gradient, l towards the light and h
halfway between l and the eye (Blinn, SIGGRAPH 1977:192).
"""

import numpy as np
from numba import njit

from renderers.art.kernels.march_types import F32, Lanes, Three
from renderers.art.kernels.opacity import ONE, ZERO, power
from renderers.simd import maximum, select, sqrt

TINY = np.float32(1e-6)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def unit(x: Lanes, y: Lanes, z: Lanes) -> tuple[Lanes, Lanes, Lanes]:
    """Give vectors of length one."""
    scale = ONE / maximum(sqrt(x * x + y * y + z * z), TINY)
    return x * scale, y * scale, z * scale


@njit(cache=True, nogil=True, error_model="numpy")
def are_grey(lights: F32) -> bool:
    """Tell whether no light, on this material, has a colour: one channel is all."""
    found = True
    for light in lights:
        found &= light[3] == light[4] and light[3] == light[5]
        found &= light[6] == light[7] and light[6] == light[8]
    return found


@njit(cache=True, nogil=True, error_model="numpy")
def any_local(lights: F32) -> bool:
    """Tell whether it matters to some light where a sample lies."""
    found = False
    for light in lights:
        found |= light[9] > ZERO
    return found


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def light_up(
    lights: F32, grey: bool, material: F32, least_gradient: np.float32, one: Lanes,
    color: Three, gradient: Three, place: Three, way: Three,
) -> Three:  # fmt: skip
    """Return colours under lights, unlit where a gradient is too small for a normal.

    lights, material: of `ShadeSettings`. grey: of `are_grey`. one: ones,
    which make vectors of numbers at no cost. place: of the samples, mm along the
    array's axes; needed if `any_local`. way: directions of the rays.
    """
    r, g, b = color
    gx, gy, gz = gradient
    x, y, z = place
    vx, vy, vz = way
    steep = sqrt(gx * gx + gy * gy + gz * gz)
    inverse = -ONE / steep
    nx, ny, nz = gx * inverse, gy * inverse, gz * inverse
    dr, er = one * material[0], one * ZERO
    dg, db, eg, eb = dr, dr, er, er
    for m in range(len(lights)):
        qx, qy, qz = one * lights[m, 0], one * lights[m, 1], one * lights[m, 2]
        if lights[m, 9] > ZERO:
            qx, qy, qz = unit(qx - x, qy - y, qz - z)
        c = maximum(nx * qx + ny * qy + nz * qz, ZERO)
        dr += c * lights[m, 3]
        if not grey:
            dg += c * lights[m, 4]
            db += c * lights[m, 5]
        if material[1] > ZERO:
            hx, hy, hz = qx - vx, qy - vy, qz - vz
            q = maximum(sqrt(hx * hx + hy * hy + hz * hz), TINY)
            c = maximum((nx * hx + ny * hy + nz * hz) / q, ZERO)
            c = power(c, material[2])
            er += c * lights[m, 6]
            if not grey:
                eg += c * lights[m, 7]
                eb += c * lights[m, 8]
    if grey:
        dg, db, eg, eb = dr, dr, er, er
    lit = steep > least_gradient
    r = select(lit, r * dr + er, r)
    g = select(lit, g * dg + eg, g)
    return r, g, select(lit, b * db + eb, b)
