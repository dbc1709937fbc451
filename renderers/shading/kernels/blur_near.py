"""Compiled: tools so near the lens that they are out of focus, a little or far.

What lies behind the blurred edge of a tool is seen through it. With the light L, the
shares m, n of a pixel that are a near tool a little or far out of focus, M = m + n, and
two blurs a and b, a pixel shows ``(1 - M) (1 - B) L + m a(L) + n b(L) + (1 - M) N``
with ``B = a(m) + b(n)``, ``N = a(m L) + b(n L)``: the light itself where no tool is
near, its blur within one, an even light wherever it is even.
"""

import numpy as np
from numba import njit

from renderers.shading.kernels.soil_lens import CELL, enlarge_row
from renderers.simd.arrays import Bytes, Floats, f32

SHARP_MM, SOFT_MM, FAR_OUT_MM = 7.0, 4.5, 2.5
"""A tool is sharp beyond the first, a little out of focus at the second, far out of it
within the third. A rigid scope is made to be sharp at some 10 to 20 mm."""

SEVEN = 7
"""Blurred are the light, that of the near tools alone, and their share."""

METAL, PLASTIC = np.uint8(1), np.uint8(2)
"""The values of `Material` that tools have."""


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _fade(depth_mm: np.float32, none_mm: float, all_mm: float) -> np.float32:
    x = (f32(none_mm) - depth_mm) * f32(1 / (none_mm - all_mm))
    x = min(max(x, f32(0)), f32(1))
    return x * x * (f32(3) - f32(2) * x)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def near_shares(
    material: np.uint8, depth_mm: np.float32
) -> tuple[np.float32, np.float32]:
    """Return how much of a pixel is a little, and far out of focus."""
    if material != METAL and material != PLASTIC:
        return f32(0), f32(0)
    both = _fade(depth_mm, SHARP_MM, SOFT_MM)
    far = _fade(depth_mm, SOFT_MM, FAR_OUT_MM)
    return both - far, far


@njit(cache=True, nogil=True, error_model="numpy")
def near_rows(material: Bytes, depth: Floats) -> tuple[int, int]:
    """Return the first row that shows a near tool and the one past the last; 0, 0."""
    first = last = 0
    for y in range(material.shape[0]):
        found = False
        for x in range(material.shape[1]):
            tool = (material[y, x] == METAL) | (material[y, x] == PLASTIC)
            found |= tool & (depth[y, x] < f32(SHARP_MM))
        if found:
            first = y if last == 0 else first
            last = y + 1
    return first, last


@njit(cache=True, nogil=True, error_model="numpy")
def shrink_near(
    radiance: Floats, material: Bytes, depth: Floats, little: Floats, far: Floats,
    first: int, last: int,
) -> None:  # fmt: skip
    """Average rows `first` to `last` of ``(ceil(h / CELL), ..., SEVEN)`` of each."""
    height, width, _ = radiance.shape
    for j in range(first, last):
        y0, y1 = j * CELL, min(j * CELL + CELL, height)
        for i in range(little.shape[1]):
            x0, x1 = i * CELL, min(i * CELL + CELL, width)
            into, other = little[j, i], far[j, i]
            into[:] = f32(0)
            other[:] = f32(0)
            for y in range(y0, y1):
                for x in range(x0, x1):
                    m, n = near_shares(material[y, x], depth[y, x])
                    for c in range(3):
                        into[c] += radiance[y, x, c]
                        into[3 + c] += m * radiance[y, x, c]
                        other[3 + c] += n * radiance[y, x, c]
                    into[6] += m
                    other[6] += n
            other[:3] = into[:3]
            into *= f32(1) / f32((y1 - y0) * (x1 - x0))
            other *= f32(1) / f32((y1 - y0) * (x1 - x0))


@njit(cache=True, nogil=True, error_model="numpy")
def blend_rows(
    radiance: Floats, material: Bytes, depth: Floats, little: Floats, far: Floats,
    result: Floats, first: int, last: int,
) -> None:  # fmt: skip
    """Put rows `first` to `last` together; little, far: blurred, see `shrink_near`."""
    width = radiance.shape[1]
    a = np.empty((SEVEN, little.shape[1] * CELL), np.float32)
    b = np.empty_like(a)
    for y in range(first, last):
        enlarge_row(little, y, a)
        enlarge_row(far, y, b)
        for x in range(width):
            m, n = near_shares(material[y, x], depth[y, x])
            other = f32(1) - m - n
            own = other * (f32(1) - a[6, x] - b[6, x])
            for c in range(3):
                light = own * radiance[y, x, c] + m * a[c, x] + n * b[c, x]
                result[y, x, c] = light + other * (a[3 + c, x] + b[3 + c, x])
