"""Opacity and powers lane by lane: the same bits as `renderers.art.optics`."""

from typing import Any

import numpy as np
from numba import njit

from renderers.art.optics.kernels import (
    BIAS,
    C3,
    C4,
    C5,
    C6,
    C7,
    DIGITS,
    HALF,
    LARGEST_POWER,
    LEAST_POWER,
    LN2,
    LN2_HIGH,
    LN2_LOW,
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
from renderers.simd import (
    as_f32,
    as_i32,
    f32,
    floor,
    i32,
    maximum,
    minimum,
    select,
)

Lanes = Any
"""A vector of `renderers.simd`."""


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def opacity(depth: Lanes) -> Lanes:
    """Give ``1 - exp(-depth)``."""
    x = minimum(depth, OPAQUE)
    n = i32(x * LOG2_E + HALF)
    f = (x - f32(n) * LN2_HIGH) - f32(n) * LN2_LOW
    q = f * f
    p = (ONE - f * R2) + q * (C3 - f * C4)
    p = f * (p + (q * q) * ((C5 - f * C6) + q * C7))
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
