"""A tile's splats dealt out to its squares, some at a time.

A square then takes all of its own in a row, its sixteen pixels in registers. What the
splats of a tile need alike is worked out here, sixteen at a time.
"""

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.fsr.classic.kernels import EACH_ROW, FLAT, FRAGMENT_BITS
from renderers.fsr.classic.ordering.kernels import KEYS
from renderers.fsr.classic.projection.kernels import CUT, RECORD
from renderers.fsr.classic.tiles import ACROSS, SIDE, SQUARES, TILE_SIDE
from renderers.simd import (
    absolute,
    as_i32,
    bits,
    f32,
    floor,
    full,
    i32,
    i64,
    lanes,
    load,
    maximum,
    minimum,
    prefetch,
    put_rows4,
    rows4,
    select,
    store,
)

F32 = NDArray[np.float32]
I32 = NDArray[np.int32]
I64 = NDArray[np.int64]
Real = float | np.float32

DEAL = 2 * SQUARES
"""Splats dealt at a time: they and a tile fit the first cache."""

HAND = 12
"""Floats of a dealt splat: centre from the tile's first pixel 0-1, what a squared
distance is made of 2-4 (for a point, half its side in place of the first), gain 5,
depth 6, sheet 7, colour 8-10."""

_W = 16
_ZERO = np.float32(0)
_ONE = np.float32(1)
_HALF = np.float32(0.5)
_REST = np.float32(0.5 * SIDE - 0.5)
"""Pixel centres of a square lie this far from its middle, along an axis."""

_BEYOND = np.float32(1 + 0.01 / CUT**2)

_WIDE = np.float32(-0.18 / CUT**2)
"""Curve of footprints so wide that leaving out their corners pays."""


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _squares_of_ellipse(dx: Any, dy: Any, slim: Any, cross: Any, flat: Any) -> Any:
    """Give the squares of a tile that a footprint may meet, a bit each.

    dx, dy: the centre from the tile's first pixel. Half widths are taken at the row
    of the square that is nearest to the centre.
    """
    slope = cross / (slim + slim)
    y = f32((lanes(SQUARES) >> 3) * SIDE) + (_REST - dy)
    x = f32((lanes(SQUARES) & 7) * SIDE) + (_REST - dx)
    beside = maximum(absolute(y) - _REST, _ZERO)
    rest = _BEYOND + beside * beside * (flat - _HALF * cross * slope)
    across = absolute(x + y * slope) - (_REST + _REST * abs(slope))
    across = maximum(across, _ZERO)
    return bits(across * across * -slim <= rest)


@njit(cache=True, nogil=True, error_model="numpy")
def room_for_deal() -> Any:
    """Make room for a deal.

    Hands ``(DEAL * HAND,)``; which of 64 of them each square got, as bits; the
    fragments per square of each.
    """
    return (
        np.empty(DEAL * HAND, np.float32),
        np.empty(DEAL, np.int64),
        np.empty(DEAL, np.int32),
    )


@njit(cache=True, nogil=True, error_model="numpy")
def transpose(words: I64) -> None:
    """Swap bit k of word m with bit m of word k (Warren, Hacker's Delight, 7-3)."""
    step = 32
    low = np.int64(0xFFFFFFFF)
    while step > 0:
        for first in range(0, SQUARES, 2 * step):
            for m in range(first, first + step):
                change = ((words[m] >> step) ^ words[m + step]) & low
                words[m + step] ^= change
                words[m] ^= change << step
        step >>= 1
        low ^= low << step


@njit(cache=True, nogil=True, error_model="numpy")
def deal_splats(
    records: F32, items: I32, first: int, size: int, left: int, top: int, alive: Any,
    points: bool, sheets_of: F32, deal: Any,
) -> Any:  # fmt: skip
    """Deal `size` of a tile's splats out to its live squares.

    first: of the items. sheets_of: see `draw_tiles`. deal: see `room_for_deal`.
    Returns the squares that got any, as bits, and how many times 64 splats were dealt.
    """
    hands, masks, shares = deal
    left_box = np.int32(left)
    top_box = np.int32(top)
    none = np.int32(0)
    end = np.int32(TILE_SIDE - 1)
    row_bits = full(np.int64(EACH_ROW), _W)
    all_bits = full(np.int64(-1), _W)
    two = full(np.int32(2), _W)
    one_each = full(np.int32(1), _W)
    ahead = min(items.shape[0], first + size + DEAL)
    for m in range(first + DEAL, ahead):
        # while these are drawn, those of the next deal come near; two lines at most
        prefetch(records, items[m] * RECORD)
        prefetch(records, items[m] * RECORD + RECORD - 1)
    for m in range(0, size, _W):
        met = lanes(_W) < np.int32(size - m)
        row = select(met, load(items, first + m, _W), np.int32(0)) * 3
        u, v, curve, twist = rows4(records, row)
        rise, peak, far, columns = rows4(records, row + 1)
        red, green, blue, rows = rows4(records, row + 2)
        x0 = maximum((as_i32(columns) & 0xFFFF) - left_box, none)
        x1 = minimum((as_i32(columns) >> 16) - left_box, end)
        y0 = maximum((as_i32(rows) & 0xFFFF) - top_box, none)
        y1 = minimum((as_i32(rows) >> 16) - top_box, end)
        pixels = (x1 - x0 + 1) * (y1 - y0 + 1)
        x0, x1, y0, y1 = x0 >> 2, x1 >> 2, y0 >> 2, y1 >> 2
        squares = (x1 - x0 + 1) * (y1 - y0 + 1)
        share = f32(pixels << FRAGMENT_BITS) / f32(squares)
        across = i64((two << x1) - (one_each << x0))
        # one row's bits, copied into rows y0 to y1
        down = row_bits >> i64((ACROSS - 1 - y1) << 3)
        live = across * (down & (all_bits << i64(y0 << 3))) & alive
        store(masks, m, select(met, live, np.int64(0)))
        if sheets_of.size > 0:
            step = maximum((far - sheets_of[0]) * sheets_of[1], _ZERO)
            step = floor(minimum(step, np.float32(KEYS - 1)))
            sheet = floor(step / sheets_of[2])
        else:
            sheet = full(_ZERO, _W)
        x = u - np.float32(left) - _HALF
        y = v - np.float32(top) - _HALF
        slim = curve if points else curve * np.float32(FLAT)
        cross = twist * np.float32(2 * FLAT)
        flat = rise * np.float32(FLAT)
        hand = (lanes(_W) + np.int32(m)) * 3
        put_rows4(hands, hand, x, y, slim, cross)
        put_rows4(hands, hand + 1, flat, peak, far, sheet)
        put_rows4(hands, hand + 2, red, green, blue, far)
        store(shares, m, i32(share))
    touched = np.int64(0)
    for m in range(size):
        o = m * HAND
        if not points and hands[o + 2] > _WIDE:
            masks[m] &= _squares_of_ellipse(
                hands[o], hands[o + 1], hands[o + 2], hands[o + 3], hands[o + 4]
            )
        touched |= masks[m]
    halves = (size + SQUARES - 1) // SQUARES
    masks[size : halves * SQUARES] = 0
    for half in range(halves):
        transpose(masks[half * SQUARES : (half + 1) * SQUARES])
    return touched, halves
