"""A tile's splats binned into its squares, some at a time.

A square then takes all of its own in a row, its sixteen pixels in registers. The
squares that a splat meets are found for sixteen splats at a time.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from renderers.fsr.kernels.array_types import F32, I32, I64, Lanes
from renderers.fsr.kernels.footprint import CUT_SHARE, SCALE
from renderers.fsr.kernels.project_splats import RECORD
from renderers.fsr.kernels.tile_buffer import ACROSS, SIDE, SQUARES, TILE_SIDE
from renderers.simd import (
    absolute,
    any_,
    bits,
    count,
    f32,
    floor,
    full,
    gather,
    i32,
    i64,
    lanes,
    load,
    maximum,
    minimum,
    prefetch,
    rows4,
    select,
    sqrt,
    store,
    store_packed,
    swapped,
)

BATCH = 2 * SQUARES
"""Splats binned at a time: they and a tile fit the first cache."""
EACH_ROW = 0x0101010101010101
"""The first square of every row of a tile."""
FRAGMENT_BITS = 8
"""Fragments of a square are counted in parts of 256."""

_W = 16
_ZERO = np.float32(0)
_ONE = np.float32(1)
_HALF = np.float32(0.5)
_REST = np.float32(0.5 * SIDE - 0.5)
"""Pixel centres of a square lie this far from its middle, along an axis."""
_BEYOND = SCALE + np.float32(0.01) * CUT_SHARE
"""`SCALE` times squared distances over the cut's that may yet round to within it."""
_ROUNDED = SCALE * np.float32(1e-6)
"""And the share of what these are summed from: much, where a footprint is a needle."""
_AHEAD = 3 * _W
"""Splats whose boxes are prefetched while others are binned."""
_WIDE = 12
"""Pixels of a box, less one, from which leaving out its corners pays."""


class Bins(NamedTuple):
    """A batch of splats binned into the squares of a tile.

    words: ``(BATCH,)``, per square which of 64 splats it got, as bits; then again for
    the next 64. offsets: where each splat's record begins. shares: its fragments per
    square. halves: its squares, low and high bits.
    """

    words: I64
    offsets: I32
    shares: I32
    halves: I32


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _squares_of_ellipses(
    u: Lanes,
    v: Lanes,
    slim: Lanes,
    cross: Lanes,
    flat: Lanes,
    x0: Lanes,
    x1: Lanes,
    y0: Lanes,
    y1: Lanes,
) -> Lanes:
    """Return the squares of a tile that footprints may meet, a bit each.

    u, v: centres from the tile's corner. x0, x1, y0, y1: first and last squares of
    their boxes. In every row of squares a footprint's half width is taken where it is
    nearest to the centre, and its middle anywhere in the row.
    """
    slope = cross / (slim + slim)
    bend = flat - cross * slope * _HALF
    wide = _ONE / slim
    most = flat / bend * _ROUNDED + _BEYOND
    aside = absolute(slope) * _REST
    first, last = f32(x0), f32(x1)
    none = full(np.int32(0), _W)
    one = none + 1
    two = none + 2
    low, high = none, none
    for row in range(ACROSS):
        y = np.float32(row * SIDE + SIDE // 2) - v
        beside = maximum(absolute(y) - _REST, _ZERO)
        rest = most - beside * beside * bend
        reach = sqrt(maximum(rest, _ZERO) * wide) + aside
        middle = u - slope * y - np.float32(SIDE // 2)
        per_square = np.float32(1 / SIDE)
        # ceil(a) is -floor(-a)
        left = maximum(-floor((reach + _REST - middle) * per_square), first)
        right = minimum(floor((middle + reach + _REST) * per_square), last)
        met = (left <= right) & (rest >= _ZERO)
        met &= (y0 <= np.int32(row)) & (y1 >= np.int32(row))
        some = select(met, (two << i32(right)) - (one << i32(left)), none)
        if row < ACROSS // 2:
            low |= some << ACROSS * row
        else:
            high |= some << ACROSS * (row - ACROSS // 2)
    return (i64(low) & np.int64(0xFFFFFFFF)) | (i64(high) << 32)


@njit(cache=True, nogil=True, error_model="numpy")
def make_bins() -> Bins:
    """Make empty bins."""
    size = BATCH + _W
    return Bins(
        np.empty(BATCH, np.int64),
        np.empty(size, np.int32),
        np.empty(size, np.int32),
        np.empty((2, size), np.int32),
    )


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _swap_bits(words: I64, first: int, step: int, low: Lanes) -> None:
    """Swap blocks of bits `step` wide between words as far apart, eight at a time."""
    for m in range(0, SQUARES, 2 * step):
        for k in range(first + m, first + m + step, 8):
            upper = load(words, k, 8)
            under = load(words, k + step, 8)
            change = ((upper >> step) ^ under) & low
            store(words, k + step, under ^ change)
            store(words, k, upper ^ (change << step))


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _swap_within(x: Lanes, low: Lanes, step: int) -> Lanes:
    """Do as `_swap_bits` between the lanes of a vector, which are eight words."""
    other = swapped(x, step)
    is_under = (i64(lanes(8)) & step) != 0
    kept = select(is_under, full(~low, 8), low)
    return (x & kept) | (select(is_under, other >> step, other << step) & ~kept)


@njit(cache=True, nogil=True, error_model="numpy")
def transpose(words: I64, first: int) -> None:
    """Swap bit k of word m with bit m of word k (Warren, Hacker's Delight, 7-3).

    first: of the 64 words.
    """
    _swap_bits(words, first, 32, np.int64(0xFFFFFFFF))
    _swap_bits(words, first, 16, np.int64(0x0000FFFF0000FFFF))
    _swap_bits(words, first, 8, np.int64(0x00FF00FF00FF00FF))
    for m in range(first, first + SQUARES, 8):
        x = load(words, m, 8)
        x = _swap_within(x, np.int64(0x0F0F0F0F0F0F0F0F), 4)
        x = _swap_within(x, np.int64(0x3333333333333333), 2)
        x = _swap_within(x, np.int64(0x5555555555555555), 1)
        store(words, m, x)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _join(words: I64, halves: I32, size: int) -> Lanes:
    """Turn squares of splats into splats of squares; give the squares that got any."""
    stride = halves.shape[1]
    touched = np.int64(0)
    for first in range(0, size, SQUARES):
        for m in range(first, first + SQUARES, 8):
            met = lanes(8) < np.int32(size - m)
            low = i64(load(halves, m, 8)) & np.int64(0xFFFFFFFF)
            both = low | (i64(load(halves, stride + m, 8)) << 32)
            store(words, m, select(met, both, np.int64(0)))
        transpose(words, first)
        for m in range(0, SQUARES, 8):
            touched |= bits(load(words, first + m, 8) != np.int64(0)) << m
    return touched


@njit(cache=True, nogil=True, error_model="numpy")
def bin_splats(
    records: F32, boxes: I32, items: I32, first: int, left: int, top: int,
    alive: Lanes, points: bool, bins: Bins,
) -> tuple[Lanes, Lanes, Lanes]:  # fmt: skip
    """Bin some of a tile's splats into its live squares, `BATCH` at most.

    first: of the items, which have sixteen to spare. Splats that meet no live square
    are passed over, and their records never read. Returns the squares that got any, as
    bits, how many times 64 splats were binned, and the first item not looked at.
    """
    words, offsets, shares, halves = bins
    width = halves.shape[1]
    left_box = np.int32(left)
    top_box = np.int32(top)
    none = np.int32(0)
    end = np.int32(TILE_SIDE - 1)
    row_bits = full(np.int64(EACH_ROW), _W)
    all_bits = full(np.int64(-1), _W)
    two = full(np.int32(2), _W)
    one_each = full(np.int32(1), _W)
    found = items.shape[0]
    size = 0
    m = first
    if first == 0:
        for k in range(min(_AHEAD, found)):
            prefetch(boxes, items[k] * 4)
    while m < found and size <= BATCH - _W:
        met = lanes(_W) < np.int32(found - m)
        item = select(met, load(items, m, _W), none)
        at = item * RECORD
        for k in range(m + _AHEAD, min(m + _AHEAD + _W, found)):
            prefetch(boxes, items[k] * 4)
        columns, rows, _, _ = rows4(boxes, item)
        x0 = (columns & 0xFFFF) - left_box
        x1 = (columns >> 16) - left_box
        y0 = (rows & 0xFFFF) - top_box
        y1 = (rows >> 16) - top_box
        is_wide = met & (x1 - x0 >= np.int32(_WIDE)) & (y1 - y0 >= np.int32(_WIDE))
        x0, x1 = maximum(x0, none), minimum(x1, end)
        y0, y1 = maximum(y0, none), minimum(y1, end)
        pixels = (x1 - x0 + 1) * (y1 - y0 + 1)
        x0, x1, y0, y1 = x0 >> 2, x1 >> 2, y0 >> 2, y1 >> 2
        if any_(is_wide) and not points:
            for k in range(m + _W, min(m + 2 * _W, found)):
                # the next are most likely wide, too
                prefetch(records, items[k] * RECORD)
            u, v, slim, cross = rows4(records, at >> 2)
            flat = gather(records, at + 4, met)
            u = u - np.float32(left)
            v = v - np.float32(top)
            those = _squares_of_ellipses(u, v, slim, cross, flat, x0, x1, y0, y1)
        else:
            across = i64((two << x1) - (one_each << x0))
            # one row's bits, copied into rows y0 to y1
            down = row_bits >> i64((ACROSS - 1 - y1) << 3)
            those = across * (down & (all_bits << i64(y0 << 3)))
        those = those & alive
        met &= those != np.int64(0)
        m += _W
        if not any_(met):
            continue
        squares = (x1 - x0 + 1) * (y1 - y0 + 1)
        share = i32(f32(pixels << FRAGMENT_BITS) / f32(squares))
        store_packed(offsets, size, at, met)
        store_packed(shares, size, share, met)
        store_packed(halves, size, i32(those), met)
        store_packed(halves, width + size, i32(those >> 32), met)
        binned = size + count(met)
        for k in range(size, binned):
            # on its way while the others are binned
            prefetch(records, offsets[k])
        size = binned
    return _join(words, halves, size), (size + SQUARES - 1) // SQUARES, m
