"""Compiled: the light around what exceeds white, from a quarter-size picture."""

import numpy as np
from numba import njit

from renderers.shading.kernels.camera_blur import across, blur_along, find_rows
from renderers.shading.kernels.camera_expose import Planes, extend_row
from renderers.simd import load, row, store, store_spread
from renderers.simd.arrays import Floats, Longs, f32

Count = int | np.int64
W = 32
ZERO, ONE = np.int64(0), np.int64(1)
"""Helpers would be compiled apart for a number that is written out."""


@njit(cache=True, nogil=True, error_model="numpy")
def widen_row(
    small: Floats,
    at: int,
    small_pitch: int,
    small_margin: int,
    columns: int,
    wide: Floats,
    to: int,
    step: int,
    pitch: int,
    margin: int,
) -> None:
    """Interpolate a row of small planes along x to four times as many pixels.

    Centres of small pixels lie at 4 i + 1.5. Beyond the outermost the margins of
    `small` count. step: flat index in `wide` of a row of scratch. Both rows may be
    overrun by four vectors.
    """
    ramp = row(f32(0.125), f32(0.375), f32(0.625), f32(0.875), W)
    cells = columns + 1
    for c in range(3):
        start = at + c * small_pitch + small_margin - 1
        pixel = to + c * pitch + margin - 2
        slope = step + c * pitch + margin - 2
        for i in range(0, cells, W):
            value = load(small, start + i, W)
            store_spread(wide, pixel + 4 * i, value)
            store_spread(wide, slope + 4 * i, load(small, start + i + 1, W) - value)
        for x in range(0, 4 * cells, W):
            value = load(wide, pixel + x, W)
            store(wide, pixel + x, value + load(wide, slope + x, W) * ramp)


@njit(cache=True, nogil=True, error_model="numpy")
def bloom_row(
    planes: Planes,
    line: Count,
    known: Count,
    taps: Floats,
    glare_share: np.float32,
    halo_share: np.float32,
    small: Floats,
    places: Longs,
    width: int,
    wide: Floats,
    to: int,
    step: int,
) -> bool:
    """Return the row `line` of glare and halo at full width; tell whether it has any.

    small: a ring of as many rows of glare as taps reach, blurred along x, of which
    those before row `known` are done; and one more row, scratch. Rows must be asked
    for in order. wide, to, step: see `widen_row`.
    """
    exposed, glare, is_lit, margin, small_margin = planes
    pitch = exposed.shape[1] // 3
    rows = is_lit.shape[0]
    columns = (width + 3) // 4
    size = glare.shape[1]
    small_pitch = size // 3
    ring = small.shape[0] - 1
    reach = taps.shape[0] - 1
    past = min(line + reach + 1, rows)
    begin = small_margin
    end = small_pitch - small_margin
    lit = False
    for near in range(max(line - reach, 0), past):
        lit |= is_lit[near] != 0
        if near >= known:
            blur_along(
                glare, near * size, taps, ONE, small, near % ring * size, small_pitch,
                begin, end,
            )  # fmt: skip
    if not lit:
        return False
    find_rows(line, rows, ONE, ZERO, ring, size, places)
    scratch = ring * size
    for c in range(3):
        for x in range(c * small_pitch + begin, c * small_pitch + end, W):
            halo = halo_share * across(small, places, taps, x)
            store(
                small,
                scratch + x,
                glare_share * load(glare, line * size + x, W) + halo,
            )
    extend_row(small, scratch, small_pitch, small_margin, columns)
    widen_row(
        small, scratch, small_pitch, small_margin, columns, wide, to, step, pitch,
        margin,
    )  # fmt: skip
    extend_row(wide, to, pitch, margin, width)
    return True
