"""Opacity and powers lane by lane: the same bits as `renderers.art.optics`."""

from typing import Any

import numpy as np
from numba import njit

from renderers.art.kernels.opacity_scalar import (
    BIAS,
    DIGITS,
    E1,
    E2,
    E3,
    E4,
    E5,
    E6,
    HALF,
    LARGEST_POWER,
    LEAST_POWER,
    LN2,
    LOG2_E,
    MANTISSA,
    MOST_FACTORS,
    ONE,
    OPAQUE,
    R2,
    R3,
    R4,
    R5,
    R6,
    R7,
    R9,
    SQRT2,
    TWO_OVER_LN2,
    UNIT,
    ZERO,
)
from renderers.lanes import as_f32, as_i32, f32, floor, i32, maximum, minimum, select

Lanes = Any
"""A vector of `renderers.simd`."""


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def opacity(depth: Lanes) -> Lanes:
    """Give ``1 - exp(-depth)``."""
    y = minimum(depth, OPAQUE) * LOG2_E
    n = i32(y + HALF)
    f = y - f32(n)
    q = f * f
    p = (E1 + f * E2) + q * (E3 + f * E4)
    p = f * (p + (q * q) * (E5 + f * E6))
    scale = as_f32((BIAS - n) << DIGITS)
    return (ONE - scale) + scale * p


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def power(base: Lanes, exponent: np.float32) -> Lanes:
    """Give ``base**exponent``."""
    if exponent == np.floor(exponent) and exponent <= MOST_FACTORS:
        result, n = select(base >= ZERO, ONE + ZERO * base, base), int(exponent)
        while n > 0:
            if n & 1:
                result = result * base
            base = base * base
            n >>= 1
        return result
    bits = as_i32(base)
    e = (bits >> DIGITS) - BIAS
    m = as_f32((bits & MANTISSA) | UNIT)
    large = m > SQRT2
    m = select(large, m * HALF, m)
    e = select(large, e + 1, e)
    z = (m - ONE) / (m + ONE)
    q = z * z
    series = ONE + q * (R3 + q * (R5 + q * (R7 + q * R9)))
    y = exponent * (f32(e) + z * TWO_OVER_LN2 * series)
    y = minimum(maximum(y, LEAST_POWER), LARGEST_POWER)
    n = floor(y + HALF)
    f = (y - n) * LN2
    p = ONE + f * R6 * (ONE + f * R7)
    p = ONE + f * R4 * (ONE + f * R5 * p)
    p = ONE + f * (ONE + f * R2 * (ONE + f * R3 * p))
    scale = as_f32((i32(n) + BIAS) << DIGITS)
    none = ONE if exponent == ZERO else ZERO
    return select(base > ZERO, scale * p, none)
