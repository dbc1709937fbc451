"""Compiled: elementary functions of vectors, as light needs them."""

from typing import Any

import numpy as np
from numba import njit

from renderers.lanes import as_f32, maximum, minimum
from renderers.lanes import f32 as to_real
from renderers.lanes import i32 as to_whole

Lanes = Any
"""A vector; it lives inside kernels only."""
Three = tuple[Lanes, Lanes, Lanes]
Four = tuple[Lanes, Lanes, Lanes, Lanes]
f32 = np.float32


@njit(cache=True, nogil=True, error_model="numpy")
def exp_negative(x: Lanes) -> Lanes:
    """Give exp(x) for x <= 0, to 1e-6 for x > -6."""
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
    """Give ``t t (3 - 2 t)``."""
    return t * t * (f32(3) - f32(2) * t)


@njit(cache=True, nogil=True, error_model="numpy")
def resolved(footprint: Lanes, per_wavelength: np.float32) -> Lanes:
    """Give how much of a wave a pixel shows: 1 to a quarter, 0 from half of it."""
    part = footprint * (f32(4) * per_wavelength) - f32(1)
    return f32(1) - smooth(minimum(maximum(part, f32(0)), f32(1)))
