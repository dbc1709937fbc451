"""Compiled: what blood and fog on the front lens do to the light that comes through.

The soil lies far out of focus: where it is, the picture behind it is a wide blur, and
red, since blood lets only red through. Fog scatters light to everywhere.
"""

import math

import numpy as np
from numba import njit

from renderers.lanes.arrays import Floats, f32

CELL = 8
"""Pixels along an edge of the picture that the blur is found on."""


@njit(cache=True, nogil=True, error_model="numpy")
def shrink(radiance: Floats, small: Floats) -> None:
    """Average every other pixel each way; small: ``(ceil(h / CELL), ..., 3)``."""
    height, width, _ = radiance.shape
    for j in range(small.shape[0]):
        y0, y1 = j * CELL, min(j * CELL + CELL, height)
        for i in range(small.shape[1]):
            x0, x1 = i * CELL, min(i * CELL + CELL, width)
            r, g, b, n = f32(0), f32(0), f32(0), 0
            for y in range(y0, y1, 2):
                for x in range(x0, x1, 2):
                    r += radiance[y, x, 0]
                    g += radiance[y, x, 1]
                    b += radiance[y, x, 2]
                    n += 1
            share = f32(1) / f32(n)
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


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _unit(value: np.float32) -> np.float32:
    return min(max(value, f32(0)), f32(1))


@njit(cache=True, nogil=True, error_model="numpy")
def enlarge_row(small: Floats, y: int, line: Floats) -> None:
    """Interpolate a row of the picture from cells; line: ``(3, cells CELL)``."""
    cells = small.shape[1]
    at = min(max((y + 0.5) / CELL - 0.5, 0.0), small.shape[0] - 1.0)
    j = min(int(at), small.shape[0] - 2)
    part = f32(at - j)
    for c in range(3):
        last = small[j, 0, c] + part * (small[j + 1, 0, c] - small[j, 0, c])
        for x in range(CELL // 2):
            line[c, x] = last
        for i in range(1, cells):
            now = small[j, i, c] + part * (small[j + 1, i, c] - small[j, i, c])
            step = (now - last) * f32(1 / CELL)
            start = i * CELL - CELL // 2
            for x in range(CELL):
                line[c, start + x] = last + (f32(x) + f32(0.5)) * step
            last = now
        for x in range(cells * CELL - CELL // 2, cells * CELL):
            line[c, x] = last


@njit(cache=True, nogil=True, error_model="numpy")
def _look(
    values: Floats, blurred: Floats, cover: Floats, thick: Floats, lit: Floats,
    takes: np.float32, mean: np.float32, grey: np.float32, veil: np.float32,
) -> None:  # fmt: skip
    """Look through the lens at one colour of a row, in place.

    takes: the share of light that thick blood takes away.
    """
    base = f32(0.25) * mean + grey
    for x in range(values.size):
        value = values[x]
        value += cover[x] * (blurred[x] - value)
        value *= f32(1) - takes * thick[x]
        value += lit[x] * mean
        values[x] = value + veil * (f32(0.55) * blurred[x] + base - value)


@njit(cache=True, nogil=True, error_model="numpy")
def _cover_row(
    here: Floats, above: Floats, soil: np.float32, wide: np.float32,
    cover: Floats, thick: Floats, lit: Floats,
) -> None:  # fmt: skip
    """Find where a row of the lens is smeared, how red it is, where it glints."""
    for x in range(cover.size):
        reached = soil - here[x]
        a = _unit((reached + wide) * f32(3.5))
        b = _unit(reached * f32(2))
        a = a * a * (f32(3) - f32(2) * a)
        cover[x] = f32(0.95) * a
        thick[x] = b * (f32(2) - b)
        # the upper edge of a drop catches the scope's light
        lit[x] = a * min(max(above[x] - here[x], f32(0)), f32(0.2))


@njit(cache=True, nogil=True, error_model="numpy")
def soil_rows(
    radiance: Floats, small: Floats, mean: Floats, pattern: Floats,
    state: tuple[float, float, int, int], result: Floats, first: int, last: int,
) -> None:  # fmt: skip
    """Look through a lens, rows `first` to `last`.

    small: the blurred picture. mean: ``(3,)`` of the whole. pattern: ``(size, size +
    w)``, periodic, with how much soil it takes until a place is covered. state: soil,
    fog, and the row and the column of the pattern in the first pixel.
    """
    _, width, _ = radiance.shape
    rows, flat = pattern.shape[0], pattern.reshape(-1)
    soil, fog = f32(state[0]), f32(state[1])
    # around a patch the lens is smeared before it is red
    wide = f32(0.12) * min(f32(4) * soil, f32(1))
    veil = fog * f32(0.8)
    grey = f32(0.35 / 3) * (mean[0] + mean[1] + mean[2])
    line = np.empty((3, small.shape[1] * CELL), np.float32)
    cover = np.empty(width, np.float32)
    thick = np.empty(width, np.float32)
    lit = np.empty(width, np.float32)
    red = np.empty(width, np.float32)
    green = np.empty(width, np.float32)
    blue = np.empty(width, np.float32)
    for y in range(first, last):
        enlarge_row(small, y, line)
        at = (y + state[2]) % rows * pattern.shape[1] + state[3]
        here = flat[at : at + width]
        at = (y + state[2] + rows - 4) % rows * pattern.shape[1] + state[3]
        above = flat[at : at + width]
        _cover_row(here, above, soil, wide, cover, thick, lit)
        # views, so that the loops' indices are plainly not negative
        source, into = radiance[y].reshape(-1), result[y].reshape(-1)
        for x in range(width):
            red[x] = source[3 * x]
            green[x] = source[3 * x + 1]
            blue[x] = source[3 * x + 2]
        _look(red, line[0], cover, thick, lit, f32(0.6), mean[0], grey, veil)
        _look(green, line[1], cover, thick, lit, f32(0.96), mean[1], grey, veil)
        _look(blue, line[2], cover, thick, lit, f32(0.96), mean[2], grey, veil)
        for x in range(width):
            into[3 * x] = red[x]
            into[3 * x + 1] = green[x]
            into[3 * x + 2] = blue[x]


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
