"""Compiled: what blood and fog on the front lens do to the light that comes through.

The soil lies far out of focus: where it is, the picture behind it is a wide blur, and
red, since blood lets only red through. Fog scatters light from everywhere to everywhere.
"""

import math

import numpy as np
from numba import njit

from renderers.lanes.arrays import Floats, f32

CELL = 4
"""Pixels along an edge of the picture that the blur is found on."""


@njit(cache=True, nogil=True, error_model="numpy")
def shrink(radiance: Floats, small: Floats) -> None:
    """Average `CELL` x `CELL` pixels; small: ``(ceil(h / CELL), ..., 3)``."""
    height, width, _ = radiance.shape
    for j in range(small.shape[0]):
        y0, y1 = j * CELL, min(j * CELL + CELL, height)
        for i in range(small.shape[1]):
            x0, x1 = i * CELL, min(i * CELL + CELL, width)
            r, g, b = f32(0), f32(0), f32(0)
            for y in range(y0, y1):
                for x in range(x0, x1):
                    r += radiance[y, x, 0]
                    g += radiance[y, x, 1]
                    b += radiance[y, x, 2]
            share = f32(1) / f32((y1 - y0) * (x1 - x0))
            small[j, i, 0] = r * share
            small[j, i, 1] = g * share
            small[j, i, 2] = b * share


@njit(cache=True, nogil=True, error_model="numpy")
def blur(small: Floats, other: Floats, reach: int) -> None:
    """Blur in place by two running means of `2 reach + 1` each way."""
    height, width, _ = small.shape
    share = f32(1) / f32(2 * reach + 1)
    for _ in range(2):
        for y in range(height):
            for c in range(3):
                total = f32(0)
                for x in range(-reach, reach + 1):
                    total += small[y, min(max(x, 0), width - 1), c]
                for x in range(width):
                    other[y, x, c] = total * share
                    total += small[y, min(x + reach + 1, width - 1), c]
                    total -= small[y, max(x - reach, 0), c]
        for c in range(3):
            for x in range(width):
                total = f32(0)
                for y in range(-reach, reach + 1):
                    total += other[min(max(y, 0), height - 1), x, c]
                for y in range(height):
                    small[y, x, c] = max(total * share, f32(0))
                    total += other[min(y + reach + 1, height - 1), x, c]
                    total -= other[max(y - reach, 0), x, c]


@njit(cache=True, nogil=True, error_model="numpy")
def soil_rows(
    radiance: Floats, small: Floats, mean: Floats, pattern: Floats,
    state: tuple[float, float, int, int], result: Floats, first: int, last: int,
) -> None:  # fmt: skip
    """Look through a lens, rows `first` to `last`.

    small: the blurred picture. mean: ``(3,)`` of the whole. pattern: periodic, with how
    much soil it takes until a place is covered. state: soil, fog, and the row and the
    column of the pattern in the first pixel.
    """
    _, width, _ = radiance.shape
    rows, columns = pattern.shape
    soil, fog = f32(state[0]), f32(state[1])
    grey = (mean[0] + mean[1] + mean[2]) * f32(1 / 3)
    line = np.empty((small.shape[1], 3), np.float32)
    for y in range(first, last):
        at = min(max((y + 0.5) / CELL - 0.5, 0.0), small.shape[0] - 1.0)
        j = min(int(at), small.shape[0] - 2)
        part = f32(at - j)
        for i in range(small.shape[1]):
            for c in range(3):
                upper = small[j, i, c]
                line[i, c] = upper + part * (small[j + 1, i, c] - upper)
        row = (y + state[2]) % rows
        above = (y + state[2] + rows - 3) % rows
        column = state[3] % columns
        for x in range(width):
            at = min(max((x + 0.5) / CELL - 0.5, 0.0), small.shape[1] - 1.0)
            i = min(int(at), small.shape[1] - 2)
            q = f32(at - i)
            # thick in the middle of a patch, thin at its edge
            reached = soil - pattern[row, column]
            cover = min(max(reached * f32(4), f32(0)), f32(1))
            thick = min(max(reached * f32(2.2), f32(0)), f32(1))
            # the upper edge of a drop catches the scope's light
            lit = f32(0)
            if cover > f32(0):
                lit = pattern[above, column] - pattern[row, column]
                lit = min(max(lit * f32(1.5), f32(0)), f32(0.25)) * cover
            hides = cover * f32(0.94)
            veil = fog * f32(0.8)
            for c in range(3):
                blurred = line[i, c] + q * (line[i + 1, c] - line[i, c])
                value = radiance[y, x, c]
                value += hides * (blurred - value)
                takes = f32(0.45) if c == 0 else f32(0.93)
                value *= f32(1) - takes * thick
                value += lit * mean[c]
                glow = f32(0.55) * blurred + f32(0.25) * mean[c] + f32(0.35) * grey
                result[y, x, c] = value + veil * (glow - value)
            column += 1
            if column == columns:
                column = 0


@njit(cache=True, nogil=True, error_model="numpy")
def mean_light(small: Floats, mean: Floats) -> None:
    """Average a picture; mean: ``(3,)``. What is not finite counts as dark."""
    for c in range(3):
        total = 0.0
        for y in range(small.shape[0]):
            for x in range(small.shape[1]):
                if math.isfinite(small[y, x, c]):
                    total += small[y, x, c]
        mean[c] = total / (small.shape[0] * small.shape[1])
