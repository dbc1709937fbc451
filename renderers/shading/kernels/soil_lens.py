"""Compiled: what lies on the front lens, and the light that comes through.

The soil lies far out of focus: where it is, the picture behind it is a wide blur, and
red where it is blood, which lets only red through, or a little milky where it is mucus.
Fog scatters light to everywhere. A drop of water is a lens: it shows its surroundings
upside down.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from renderers.simd.arrays import Floats, f32

CELL = 8
"""Pixels along an edge of the picture that the blur is found on."""


class Soiled(NamedTuple):
    """What a row of the lens is covered with.

    cover: share of it that is smeared. thick: how red that is. milk: how milky. lit:
    where it glints.
    """

    cover: Floats
    thick: Floats
    milk: Floats
    lit: Floats


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
    height, width, channels = small.shape
    share = f32(1) / f32(2 * reach + 1)
    for _ in range(2):
        for y in range(height):
            for c in range(channels):
                total = f32(0)
                for x in range(-reach, reach + 1):
                    total += small[y, min(max(x, 0), width - 1), c]
                for x in range(width):
                    other[y, x, c] = total * share
                    total += small[y, min(x + reach + 1, width - 1), c]
                    total -= small[y, max(x - reach, 0), c]
        for c in range(channels):
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
    """Interpolate a row of the picture from cells; line: ``(n, cells CELL)``."""
    cells = small.shape[1]
    at = min(max((y + 0.5) / CELL - 0.5, 0.0), small.shape[0] - 1.0)
    j = min(int(at), small.shape[0] - 2)
    part = f32(at - j)
    for c in range(line.shape[0]):
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
    values: Floats, blurred: Floats, soil: Soiled, takes: np.float32,
    mean: np.float32, grey: np.float32, veil: np.float32,
) -> None:  # fmt: skip
    """Look through the lens at one colour of a row, in place.

    takes: the share of light that thick blood takes away.
    """
    base = f32(0.25) * mean + f32(0.35) * grey
    for x in range(values.size):
        value = values[x]
        value += soil.cover[x] * (blurred[x] - value)
        value *= f32(1) - takes * soil.thick[x]
        value += soil.lit[x] * mean
        value += soil.milk[x] * (grey - value)
        values[x] = value + veil * (f32(0.55) * blurred[x] + base - value)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _reached(amount: np.float32, needs: np.float32) -> np.float32:
    """Return how much of a place is smeared; around a patch it fades."""
    a = _unit((amount - needs + f32(0.12) * min(f32(4) * amount, f32(1))) * f32(3.5))
    return a * a * (f32(3) - f32(2) * a)


@njit(cache=True, nogil=True, error_model="numpy")
def _cover_row(here: Floats, above: Floats, amounts: Floats, soil: Soiled) -> None:
    """Find where a row of the lens is smeared, how red it is, where it glints.

    amounts: of blood and of mucus at each place.
    """
    for x in range(here.size):
        blood = _reached(amounts[0, x], here[x])
        mucus = _reached(amounts[1, x], here[x])
        b = _unit((amounts[0, x] - here[x]) * f32(2))
        soil.cover[x] = f32(0.95) * max(blood, mucus)
        soil.thick[x] = b * (f32(2) - b)
        soil.milk[x] = f32(0.16) * mucus * (f32(1) - blood)
        # the upper edge of a patch catches the scope's light
        glint = min(max(above[x] - here[x], f32(0)), f32(0.2))
        soil.lit[x] = max(blood, f32(0.4) * mucus) * glint


@njit(cache=True, nogil=True, error_model="numpy")
def _drop_row(small: Floats, drop: Floats, y: int, row: Floats) -> None:
    """Show the surroundings upside down in a drop, in a row of the picture.

    drop: column, row and radius of it, pixels, and how much it hides.
    """
    radius = drop[2]
    v = (f32(y) - drop[1]) / radius
    if not abs(v) < f32(1):
        return
    half = math.sqrt(f32(1) - v * v) * radius
    first = max(int(drop[0] - half), 0)
    last = min(int(drop[0] + half) + 1, row.shape[0])
    jy = (drop[1] - f32(4) * v * radius) / f32(CELL) - f32(0.5)
    jy = min(max(jy, f32(0)), f32(small.shape[0] - 1))
    j = min(int(jy), small.shape[0] - 2)
    for x in range(first, last):
        u = (f32(x) - drop[0]) / radius
        inside = f32(1) - (u * u + v * v)
        if not inside > f32(0):
            continue
        share = drop[3] * min(f32(2) * inside, f32(1))
        ix = (drop[0] - f32(4) * u * radius) / f32(CELL) - f32(0.5)
        ix = min(max(ix, f32(0)), f32(small.shape[1] - 1))
        i = min(int(ix), small.shape[1] - 2)
        p, q = ix - f32(i), jy - f32(j)
        # light from above gathers at its lower edge; its rim is dark
        bright = min(f32(2.2) * inside + f32(0.35), f32(1)) + f32(0.5) * max(v, f32(0))
        for c in range(3):
            upper = small[j, i, c] + p * (small[j, i + 1, c] - small[j, i, c])
            lower = small[j + 1, i, c]
            lower += p * (small[j + 1, i + 1, c] - lower)
            seen = bright * (upper + q * (lower - upper))
            row[x, c] += share * (seen - row[x, c])


@njit(cache=True, nogil=True, error_model="numpy")
def soil_rows(
    radiance: Floats, small: Floats, mean: Floats, pattern: Floats, amounts: Floats,
    drops: Floats, state: tuple[float, int, int], result: Floats, first: int, last: int,
) -> None:  # fmt: skip
    """Look through a lens, rows `first` to `last`.

    small: the blurred picture. mean: ``(3,)`` of the whole. pattern: ``(size, size +
    w)``, periodic, with how much soil it takes until a place is covered. amounts: of
    blood and mucus in each cell. drops: ``(n, 4)``, see `_drop_row`. state: fog, and
    the row and the column of the pattern in the first pixel.
    """
    _, width, _ = radiance.shape
    rows, flat = pattern.shape[0], pattern.reshape(-1)
    veil = f32(state[0]) * f32(0.8)
    grey = f32(1 / 3) * (mean[0] + mean[1] + mean[2])
    line = np.empty((3, small.shape[1] * CELL), np.float32)
    there = np.empty((2, small.shape[1] * CELL), np.float32)
    soil = Soiled(
        np.empty(width, np.float32),
        np.empty(width, np.float32),
        np.empty(width, np.float32),
        np.empty(width, np.float32),
    )
    red = np.empty(width, np.float32)
    green = np.empty(width, np.float32)
    blue = np.empty(width, np.float32)
    for y in range(first, last):
        enlarge_row(small, y, line)
        enlarge_row(amounts, y, there)
        at = (y + state[1]) % rows * pattern.shape[1] + state[2]
        here = flat[at : at + width]
        at = (y + state[1] + rows - 4) % rows * pattern.shape[1] + state[2]
        above = flat[at : at + width]
        _cover_row(here, above, there, soil)
        # views, so that the loops' indices are plainly not negative
        source, into = radiance[y].reshape(-1), result[y].reshape(-1)
        for x in range(width):
            red[x] = source[3 * x]
            green[x] = source[3 * x + 1]
            blue[x] = source[3 * x + 2]
        _look(red, line[0], soil, f32(0.6), mean[0], grey, veil)
        _look(green, line[1], soil, f32(0.96), mean[1], grey, veil)
        _look(blue, line[2], soil, f32(0.96), mean[2], grey, veil)
        for x in range(width):
            into[3 * x] = red[x]
            into[3 * x + 1] = green[x]
            into[3 * x + 2] = blue[x]
        for n in range(drops.shape[0]):
            _drop_row(small, drops[n], y, result[y])


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
