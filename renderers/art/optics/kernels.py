"""Opacity and powers in float32, by operations that vectors have as well.

Library functions differ in the last bit between processors and between scalar and
vector code; these are a few additions and products in a fixed order.
"""

import numpy as np
from numba import njit

ZERO, ONE, HALF = np.float32(0), np.float32(1), np.float32(0.5)

LOG2_E = np.float32(1.4426950408889634)
LN2 = np.float32(0.6931471805599453)

LN2_HIGH = np.float32(0.693145751953125)
"""ln 2 in so few bits that its product with a small whole number is exact."""

LN2_LOW = np.float32(1.4286068203094172e-06)
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

C3, C4, C5 = np.float32(1 / 6), np.float32(1 / 24), np.float32(1 / 120)
C6, C7 = np.float32(1 / 720), np.float32(1 / 5040)


@njit(cache=True, nogil=True, error_model="numpy")
def opacity(depth: np.float32) -> np.float32:
    """Give ``1 - exp(-depth)`` of an optical depth >= 0 to 2e-7, relatively.

    ``exp(-depth) = 2**-n (1 + expm1(-f))`` with ``|f| <= ln(2) / 2``, so that thin
    segments lose no digit. The series is added by pairs: less waits for less.
    """
    x = min(depth, OPAQUE)
    n = np.int32(x * LOG2_E + HALF)
    f = (x - np.float32(n) * LN2_HIGH) - np.float32(n) * LN2_LOW
    q = f * f
    p = (ONE - f * R2) + q * (C3 - f * C4)
    p = f * (p + (q * q) * ((C5 - f * C6) + q * C7))
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
