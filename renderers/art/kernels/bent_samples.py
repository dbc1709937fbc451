"""Compiled: what one sample of a bent ray is worth."""

import math
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.art.cells.brick_views import Classification
from renderers.art.kernels.build_bricks import SHORT
from renderers.art.kernels.opacity import (
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

F32 = NDArray[np.float32]
F64 = NDArray[np.float64]

U = np.uintp
"""Makes an index unsigned, so that numba does not look whether it counts from the end:
5 % of the whole march (measured)."""


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


@njit(cache=True, nogil=True, error_model="numpy")
def along_row(samples: NDArray[Any], at: int, next_: int, fx: np.float32) -> np.float32:
    """Interpolate between two voxels along x."""
    a, b = np.float32(samples[U(at)]), np.float32(samples[U(at + next_)])
    return a + fx * (b - a)


@njit(cache=True, nogil=True, error_model="numpy")
def across_rows(
    samples: NDArray[Any], at: int, row: int, slab: int, w: int, fz: np.float32
) -> np.float32:
    """Interpolate four voxels along y, in whole numbers, and z."""
    q, u = at + slab, int(SHORT) - w
    a = np.float32(int(samples[U(at)]) * u + int(samples[U(at + row)]) * w)
    b = np.float32(int(samples[U(q)]) * u + int(samples[U(q + row)]) * w)
    return a + fz * (b - a)


@njit(cache=True, nogil=True, error_model="numpy")
def trilinear(
    samples: NDArray[Any], at: int, next_: int, row: int, slab: int,
    fx: np.float32, fy: np.float32, fz: np.float32,
) -> np.float32:  # fmt: skip
    """Interpolate one channel of interleaved samples between eight voxels.

    next_, row, slab: numbers from a voxel to the next along x, y and z.

    float32: along x, then y, then z. int16: 32767 times as much; y in whole numbers,
    then z, then x.
    """
    if samples.itemsize == 2:
        w = int(fy * SHORT + HALF)
        left = across_rows(samples, at, row, slab, w, fz)
        right = across_rows(samples, at + next_, row, slab, w, fz)
        return left + fx * (right - left)
    front = along_row(samples, at, next_, fx)
    front += fy * (along_row(samples, at + row, next_, fx) - front)
    back = along_row(samples, at + slab, next_, fx)
    back += fy * (along_row(samples, at + slab + row, next_, fx) - back)
    return front + fz * (back - front)


@njit(cache=True, nogil=True, error_model="numpy")
def classify(
    table: Classification, v: np.float32
) -> tuple[np.float32, np.float32, np.float32, np.float32]:
    """Give extinction, red, green, blue of a density."""
    at = min(max((v - table.low) * table.scale + ONE, ZERO), table.last)
    f = at - np.float32(int(at))
    line = table.lines[U(int(at))]
    if line[0] + f * line[1] >= ZERO:
        return (
            line[0] + f * line[1],
            line[2] + f * line[3],
            line[4] + f * line[5],
            line[6] + f * line[7],
        )
    k = table.first[int(at)]
    while v >= table.extinction[k, 1]:
        k += 1
    dv = max(v - table.extinction[k, 0], ZERO)
    color, slope = table.color[k], table.color_slope[k]
    return (
        table.extinction[k, 2] + dv * table.extinction[k, 3],
        color[0] + dv * slope[0],
        color[1] + dv * slope[1],
        color[2] + dv * slope[2],
    )


@njit(cache=True, nogil=True, error_model="numpy")
def light_sample(
    normal: F64, at: F64, way: F64, lights: F32, material: F32, color: F64
) -> None:
    """Light a sample's colour, in place; at: mm, way: the ray's unit direction."""
    given, glint = np.full(3, float(material[0])), np.zeros(3)
    to_light, half = np.empty(3), np.empty(3)
    for m in range(len(lights)):
        length = 0.0
        for k in range(3):
            to_light[k] = lights[m, k]
            if lights[m, 9] > ZERO:
                to_light[k] -= at[k]
            length += to_light[k] * to_light[k]
        if lights[m, 9] > ZERO:
            to_light /= max(math.sqrt(length), 1e-6)
        facing = max(np.sum(normal * to_light), 0.0)
        for k in range(3):
            given[k] += facing * lights[m, 3 + k]
        if material[1] > ZERO:
            half[:] = to_light - way
            width = max(math.sqrt(np.sum(half * half)), 1e-6)
            facing = max(np.sum(normal * half) / width, 0.0)
            shine = power(np.float32(facing), material[2])
            for k in range(3):
                glint[k] += shine * lights[m, 6 + k]
    for k in range(3):
        color[k] = color[k] * given[k] + glint[k]


@njit(cache=True, nogil=True, error_model="numpy")
def half_outside(a: float, b: float) -> np.float32:
    """Give how much of half a step, .5 at most, is not in a gap, from its openings."""
    if min(a, b) >= 0.0:
        return np.float32(0.5)
    top = max(a, b)
    if top < 0.0:
        return np.float32(0.0)
    # beyond a ball's rim there is no face to be near: half of that half
    if np.isinf(top):
        return np.float32(0.25)
    return np.float32(0.5 * top / (top - min(a, b)))


@njit(cache=True, nogil=True, error_model="numpy")
def outside(before: float, middle: float, after: float) -> np.float32:
    """Give the share of a step that is not in a gap, from openings at three places."""
    return half_outside(before, middle) + half_outside(middle, after)
