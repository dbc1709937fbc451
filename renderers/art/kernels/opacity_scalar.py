"""Opacity and powers in float32, by operations that vectors have as well.

Library functions differ in the last bit between processors and between scalar and
vector code; these are a few additions and products in a fixed order.
"""

import numpy as np
from numba import njit

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


@njit(cache=True, nogil=True, error_model="numpy")
def opacity(depth: np.float32) -> np.float32:
    """Give ``1 - exp(-depth)`` of an optical depth >= 0 to 4e-7, relatively.

    ``exp(-depth) = 2**-n (1 - (1 - 2**-f))`` with ``|f| <= 1/2``, so that thin segments
    lose no digit. What rounding the exponent of a thick one costs is nothing beside 1.
    The series is added by pairs: less waits for less.
    """
    y = min(depth, OPAQUE) * LOG2_E
    n = np.int32(y + HALF)
    f = y - np.float32(n)
    q = f * f
    p = (E1 + f * E2) + q * (E3 + f * E4)
    p = f * (p + (q * q) * (E5 + f * E6))
    scale = np.int32((BIAS - n) << DIGITS).view(np.float32)
    result: np.float32 = (ONE - scale) + scale * p
    return result


@njit(cache=True, nogil=True, error_model="numpy")
def power(base: np.float32, exponent: np.float32) -> np.float32:
    """Give ``base**exponent`` of numbers >= 0, relatively to 1e-7 (1 + exponent).

    A base that is not 0 is a normal number.
    """
    if exponent == np.floor(exponent) and exponent <= MOST_FACTORS:
        product, n = ONE, int(exponent)
        while n > 0:
            if n & 1:
                product *= base
            base *= base
            n >>= 1
        return product
    if base <= ZERO:
        return ONE if exponent == ZERO else ZERO
    bits = np.float32(base).view(np.int32)
    e = np.int32((bits >> DIGITS) - BIAS)
    m = np.int32((bits & MANTISSA) | UNIT).view(np.float32)
    if m > SQRT2:
        m, e = m * HALF, np.int32(e + 1)
    z = (m - ONE) / (m + ONE)
    q = z * z
    series = ONE + q * (R3 + q * (R5 + q * (R7 + q * R9)))
    y = exponent * (np.float32(e) + z * TWO_OVER_LN2 * series)
    y = min(max(y, LEAST_POWER), LARGEST_POWER)
    n = np.floor(y + HALF)
    f = (y - n) * LN2
    p = ONE + f * R6 * (ONE + f * R7)
    p = ONE + f * R4 * (ONE + f * R5 * p)
    p = ONE + f * (ONE + f * R2 * (ONE + f * R3 * p))
    scale = np.int32((np.int32(n) + BIAS) << DIGITS).view(np.float32)
    raised: np.float32 = scale * p
    return raised
