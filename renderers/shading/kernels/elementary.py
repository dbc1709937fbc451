"""Compiled: elementary functions of vectors, and triples of a block of pixels."""

import numpy as np
from numba import njit

from renderers.shading.kernels.pixel_block import N
from renderers.simd import as_f32, load, maximum, minimum, store
from renderers.simd import f32 as to_real
from renderers.simd import i32 as to_whole
from renderers.simd.arrays import Floats, Lanes, f32

NEAREST_MM2 = 0.6
"""Squared: a wall is lit as if no fibre end, which is no point, were nearer."""

Three = tuple[Lanes, Lanes, Lanes]
Four = tuple[Lanes, Lanes, Lanes, Lanes]


@njit(cache=True, nogil=True, error_model="numpy")
def exp_negative(x: Lanes) -> Lanes:
    """Return exp(x) for x <= 0, to 1e-6 for x > -6."""
    y = maximum(x * f32(1.4426950408889634), f32(-126.0))
    # the shift may round k up or down, but what is left of y is exact
    k = to_whole(y + f32(127))
    r = y - to_real(k - 127)
    p = r * f32(1.8775767e-3) + f32(8.9893397e-3)
    p = p * r + f32(5.5826318e-2)
    p = p * r + f32(2.4015361e-1)
    p = p * r + f32(6.9315308e-1)
    p = p * r + f32(0.99999994)
    return p * as_f32(k << 23)


@njit(cache=True, nogil=True, error_model="numpy")
def smooth(t: Lanes) -> Lanes:
    """Return ``t t (3 - 2 t)``."""
    return t * t * (f32(3) - f32(2) * t)


@njit(cache=True, nogil=True, error_model="numpy")
def resolved(footprint: Lanes, per_wavelength: np.float32) -> Lanes:
    """Return how much of a wave a pixel shows: 1 to a quarter, 0 from half of it."""
    part = footprint * (f32(4) * per_wavelength) - f32(1)
    return f32(1) - smooth(minimum(maximum(part, f32(0)), f32(1)))


@njit(cache=True, nogil=True, error_model="numpy")
def load3(w: Floats, at: int) -> Three:
    """Load x, y and z of a block's pixels."""
    return load(w, at, N), load(w, at + N, N), load(w, at + 2 * N, N)


@njit(cache=True, nogil=True, error_model="numpy")
def store3(w: Floats, at: int, x: Lanes, y: Lanes, z: Lanes) -> None:
    """Store x, y and z of a block's pixels."""
    store(w, at, x)
    store(w, at + N, y)
    store(w, at + 2 * N, z)


@njit(cache=True, nogil=True, error_model="numpy")
def rotated(m: Floats, x: Lanes, y: Lanes, z: Lanes) -> Three:
    """Return a 3 x 3 matrix times a vector, of numbers or of lanes."""
    return (
        m[0, 0] * x + m[0, 1] * y + m[0, 2] * z,
        m[1, 0] * x + m[1, 1] * y + m[1, 2] * z,
        m[2, 0] * x + m[2, 1] * y + m[2, 2] * z,
    )


@njit(cache=True, nogil=True, error_model="numpy")
def along_axes(m: Floats, x: Lanes, y: Lanes, z: Lanes) -> Three:
    """Return the sum of a matrix's rows times x, y and z, of numbers or of lanes."""
    return (
        m[0, 0] * x + m[1, 0] * y + m[2, 0] * z,
        m[0, 1] * x + m[1, 1] * y + m[2, 1] * z,
        m[0, 2] * x + m[1, 2] * y + m[2, 2] * z,
    )
