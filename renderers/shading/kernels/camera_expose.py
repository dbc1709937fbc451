"""Compiled: from interleaved radiance to exposed colour planes, and what exceeds white.

A picture of planes is ``(rows, 3 pitch)``: a row's three channels one after another,
each with `margin` values before its first pixel and more than a vector after its last.
Both margins repeat the pixel beside them, so that blurs need no special case. Vectors
may overrun a row's last pixel into its margin.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from renderers.simd import any_, full, load, maximum, minimum, store
from renderers.simd.arrays import Bytes, Floats, Ints, f32

W = 32


class Lateral(NamedTuple):
    """Where one colour channel of a picture is read.

    runs: ``(n, 3)`` first pixel, past the last, by how much their source lies to the
    right. part: how far each pixel lies from its source towards the next, and a vector
    of zeros. row, row_part: ``(h,)`` the same for rows.
    """

    runs: Ints
    part: Floats
    row: Ints
    row_part: Floats


class Planes(NamedTuple):
    """A picture of colour planes, and what of it exceeds white.

    exposed: ``(h, 3 pitch)``. glare: ``(h / 4, 3 small_pitch)``, means of 4 x 4 pixels.
    is_lit: rows of `glare` that are not zero. margin, small_margin: of their rows.
    """

    exposed: Floats
    glare: Floats
    is_lit: Bytes
    margin: int
    small_margin: int


@njit(cache=True, nogil=True, error_model="numpy")
def split_row(radiance: Floats, y: int, planes: Floats, at: int, pitch: int) -> None:
    """Copy one interleaved row to three planes, the first at flat index `at`."""
    width = radiance.shape[1]
    # views, so that the indices of the loop are plainly not negative
    row = radiance[y].reshape(-1)
    flat = planes.reshape(-1)
    red = flat[at : at + width]
    green = flat[at + pitch : at + pitch + width]
    blue = flat[at + 2 * pitch : at + 2 * pitch + width]
    for x in range(width):
        red[x] = row[3 * x]
        green[x] = row[3 * x + 1]
        blue[x] = row[3 * x + 2]


@njit(cache=True, nogil=True, error_model="numpy")
def clear_row(planes: Floats, at: int, size: int) -> None:
    """Set `size` values from flat index `at` on to zero; whole vectors."""
    for x in range(at, at + size, W):
        store(planes, x, full(f32(0), W))


@njit(cache=True, nogil=True, error_model="numpy")
def extend_row(planes: Floats, at: int, pitch: int, margin: int, width: int) -> None:
    """Repeat the first and last pixel of the row at flat index `at` in its margins."""
    flat = planes.reshape(-1)
    for start in range(at, at + 3 * pitch, pitch):
        past = start + margin + width
        left = full(flat[start + margin], W)
        right = full(flat[past - 1], W)
        for x in range(start, start + margin, W):
            store(planes, x, left)
        for x in range(past, start + pitch - W, W):
            store(planes, x, right)
        store(planes, start + pitch - W, right)


@njit(cache=True, nogil=True, error_model="numpy")
def shift_row(
    raw: Floats,
    upper: int,
    lower: int,
    p: np.float32,
    q: np.float32,
    runs: Ints,
    part: Floats,
    white: np.float32,
    exposed: Floats,
    at: int,
) -> bool:
    """Interpolate one channel's row; tell whether anything exceeds white.

    The result is `p` times row `upper` and `q` times row `lower`. runs: first pixel,
    past the last, and by how much their source lies to the right. part: how far each
    pixel lies from its source towards the next.
    """
    top = full(f32(0), W)
    for k in range(runs.shape[0]):
        shift = runs[k, 2]
        # what overruns a run is written again by the next
        for x in range(runs[k, 0], runs[k, 1], W):
            u = upper + x + shift
            v = lower + x + shift
            left = p * load(raw, u, W) + q * load(raw, v, W)
            right = p * load(raw, u + 1, W) + q * load(raw, v + 1, W)
            value = left + load(part, x, W) * (right - left)
            top = maximum(value, top)
            store(exposed, at + x, value)
    is_bright: bool = any_(top > white)
    return is_bright


@njit(cache=True, nogil=True, error_model="numpy")
def scale_row(
    raw: Floats,
    start: int,
    gain: np.float32,
    white: np.float32,
    exposed: Floats,
    at: int,
    width: int,
) -> bool:
    """Multiply one channel's row; tell whether anything exceeds white."""
    top = full(f32(0), W)
    for x in range(0, width, W):
        value = gain * load(raw, start + x, W)
        top = maximum(value, top)
        store(exposed, at + x, value)
    is_bright: bool = any_(top > white)
    return is_bright


@njit(cache=True, nogil=True, error_model="numpy")
def add_excess(
    exposed: Floats, at: int, white: np.float32, is_first: bool, total: Floats
) -> None:
    """Add what of a row exceeds white, at most 3, to `total`, or begin it."""
    for i in range(0, total.size, W):
        value = minimum(maximum(load(exposed, at + i, W) - white, f32(0)), f32(3))
        if not is_first:
            value = value + load(total, i, W)
        store(total, i, value)


@njit(cache=True, nogil=True, error_model="numpy")
def average_fours(
    total: Floats, margin: int, width: int, glare: Floats, row: int, small_margin: int
) -> None:
    """Sum fours of a row of column sums into a row of `glare`, over 16."""
    flat = total.reshape(-1)
    pitch = total.size // 3
    small_pitch = glare.shape[1] // 3
    columns = (width + 3) // 4
    for c in range(3):
        line = flat[c * pitch + margin : (c + 1) * pitch]
        # the margin repeats the last pixel, which must not count twice
        for x in range(width, 4 * columns):
            line[x] = f32(0)
        start = c * small_pitch + small_margin
        into = glare[row, start : start + columns]
        for i in range(columns):
            pair = line[4 * i] + line[4 * i + 1]
            into[i] = (pair + (line[4 * i + 2] + line[4 * i + 3])) * f32(1 / 16)


@njit(cache=True, nogil=True, error_model="numpy")
def expose_rows(
    radiance: Floats,
    gain: np.float32,
    white: np.float32,
    red: Lateral,
    blue: Lateral,
    planes: Planes,
    raw: Floats,
    total: Floats,
    first: int,
    last: int,
) -> None:
    """Apply gain, and lateral colour: red a little larger, blue a little smaller.

    A channel's row y is read between source rows ``row[y]`` and the next. Works on
    rows ``4 first`` to ``4 last``, and averages what exceeds `white` over 4 x 4 pixels:
    rows `first` to `last` of the glare. raw: a ring of rows of planes, scratch. total:
    one row of planes, scratch.
    """
    exposed, glare, is_lit, margin, small_margin = planes
    red_runs, red_part, red_row, red_row_part = red
    blue_runs, blue_part, blue_row, blue_row_part = blue
    height, width = radiance.shape[:2]
    size = exposed.shape[1]
    pitch = size // 3
    ring = raw.shape[0]
    columns = (width + 3) // 4
    small_size = glare.shape[1]
    small_pitch = small_size // 3
    split = min(4 * first, min(red_row[4 * first], blue_row[4 * first]))
    for small in range(first, last):
        lit = False
        for y in range(4 * small, min(4 * small + 4, height)):
            needed = max(y, max(red_row[y], blue_row[y]) + 1)
            while split <= needed:
                split_row(radiance, split, raw, split % ring * size + margin, pitch)
                split += 1
            at = y * size + margin
            upper = red_row[y] % ring * size + margin
            lower = (red_row[y] + 1) % ring * size + margin
            q = gain * red_row_part[y]
            bright = shift_row(
                raw, upper, lower, gain - q, q, red_runs, red_part, white, exposed, at
            )
            at += pitch
            start = y % ring * size + pitch + margin
            bright |= scale_row(raw, start, gain, white, exposed, at, width)
            at += pitch
            upper = blue_row[y] % ring * size + 2 * pitch + margin
            lower = (blue_row[y] + 1) % ring * size + 2 * pitch + margin
            q = gain * blue_row_part[y]
            bright |= shift_row(
                raw, upper, lower, gain - q, q, blue_runs, blue_part, white, exposed, at
            )
            extend_row(exposed, y * size, pitch, margin, width)
            if bright:
                add_excess(exposed, y * size, white, not lit, total)
                lit = True
        is_lit[small] = lit
        if lit:
            average_fours(total, margin, width, glare, small, small_margin)
            extend_row(glare, small * small_size, small_pitch, small_margin, columns)
        else:
            clear_row(glare, small * small_size, small_size)
