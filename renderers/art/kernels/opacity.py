"""Opacity and powers in float32, lane by lane.

Library functions differ in the last bit between processors and between widths of
vectors; these are a few additions and products in a fixed order.
"""

import numpy as np
from numba import njit

from renderers.art.kernels.march_types import Lanes
from renderers.simd import as_f32, as_i32, f32, floor, i32, maximum, minimum, select

ZERO, ONE, HALF = np.float32(0), np.float32(1), np.float32(0.5)

LOG2_E = np.float32(1.4426950408889634)
LN2 = np.float32(0.6931471805599453)

TWO_OVER_LN2 = np.float32(2.8853900817779268)

OPAQUE = np.float32(80)
"""An optical depth whose transmittance float32 cannot tell from none."""

LEAST_POWER, LARGEST_POWER = np.float32(-126), np.float32(126)
"""Powers of two are kept where float32 has all its digits."""

MOST_FACTORS = np.float32(128)
"""Whole exponents up to this are products, by squaring: a fifth of the time."""

SQRT2 = np.float32(1.4142135623730951)
MANTISSA, UNIT, BIAS, DIGITS = 0x7FFFFF, 0x3F800000, 127, 23

R2, R3, R4 = np.float32(1 / 2), np.float32(1 / 3), np.float32(1 / 4)
R5, R6, R7 = np.float32(1 / 5), np.float32(1 / 6), np.float32(1 / 7)
R9 = np.float32(1 / 9)

E1, E2 = np.float32(0.69314718793), np.float32(-0.24022649795)
E3, E4 = np.float32(0.05550357434), np.float32(-0.00961823749)
E5, E6 = np.float32(0.00133907355), np.float32(-0.00015403513)
"""``(1 - 2**-f) / f`` for ``|f| <= 1/2``, to 1.1e-8 of itself (Remez)."""


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def opacity(depth: Lanes) -> Lanes:
    """Give ``1 - exp(-depth)`` of optical depths >= 0 to 4e-7, relatively.

    ``exp(-depth) = 2**-n (1 - (1 - 2**-f))`` with ``|f| <= 1/2``, so that thin segments
    lose no digit. What rounding the exponent of a thick one costs is nothing beside 1.
    The series is added by pairs: less waits for less.
    """
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
    """Give ``base**exponent`` of numbers >= 0, relatively to 1e-7 (1 + exponent).

    A base that is not 0 is a normal number. Whole exponents up to `MOST_FACTORS` are
    products by squaring. Others go by ``2**(exponent log2(base))``: the logarithm is
    the series of ``2 artanh((m - 1) / (m + 1))`` of the mantissa, the power that of the
    exponential function.
    """
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
