"""Which surfels a tile's pixels may show, and which squares those meet."""

import numpy as np
from numba import njit

from renderers.fsr.kernels.array_types import F32, I32, Real
from renderers.fsr.kernels.project_surfels import tile_range
from renderers.fsr.kernels.surfel_tiles import (
    BLOCK,
    BLOCKS,
    BLOCKS_X,
    BLOCKS_Y,
    SIDE,
    SQUARE,
    SQUARES_X,
    SQUARES_Y,
    TILE_HEIGHT,
    TILE_WIDTH,
)
from renderers.simd import (
    absolute,
    bits,
    count,
    f32,
    full,
    i32,
    lanes,
    load,
    maximum,
    minimum,
    select,
    sqrt,
    store,
    store_packed,
)

HIGH_BITS = -(1 << 31) | 1 << 23 | 1 << 15 | 1 << 7
"""The highest bit of each byte of a range of tiles."""
EVERY_ROW = sum(1 << k * BLOCKS_X for k in range(BLOCKS_Y))
"""The first block of every row of a tile's blocks, a bit a block."""

_HALF = np.float32(0.5)
_ONE = np.float32(1)
_ZERO = np.float32(0)


@njit(cache=True, nogil=True, error_model="numpy")
def list_tile(ranges: I32, n: int, column: int, row: int, items: I32) -> int:
    """List which of n surfels touch a tile, in order; return their number.

    ranges: see `tile_range`. ranges and items have sixteen to spare.
    """
    # each byte is one subtraction that borrows from its highest bit, or does not
    place = np.int32(tile_range(column, column, row, row) | HIGH_BITS)
    found = 0
    for s in range(0, n, SQUARE):
        left = (place - load(ranges, s, SQUARE)) & np.int32(HIGH_BITS)
        number = lanes(SQUARE) + np.int32(s)
        met = (left == np.int32(HIGH_BITS)) & (number < n)
        if bits(met) != 0:
            store_packed(items, found, number, met)
            found += count(met)
    return found


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def is_hidden(far: F32, boxes: I32, s: int, left: int, top: int, depth: Real) -> bool:
    """True if all blocks that a box touches are covered nearer than a depth."""
    x0 = max(int(boxes[s, 0]) - left, 0) // BLOCK
    x1 = min(int(boxes[s, 1]) - left, TILE_WIDTH - 1) // BLOCK
    y0 = max(int(boxes[s, 2]) - top, 0) // BLOCK
    y1 = min(int(boxes[s, 3]) - top, TILE_HEIGHT - 1) // BLOCK
    touched = ((2 << x1) - (1 << x0)) * EVERY_ROW
    touched &= (2 << (y1 * BLOCKS_X + BLOCKS_X - 1)) - (1 << (y0 * BLOCKS_X))
    covered: int = bits(load(far, 0, BLOCKS) * depth >= _ONE)
    return touched & ~covered == 0


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def list_squares(
    records: F32, o: int, boxes: I32, s: int, left: int, top: int, starts: I32,
    ends: I32, squares: I32, at: int,
) -> int:  # fmt: skip
    """List the squares that an ellipse meets from place `at` on; return the end.

    A run of squares is written as whole vectors and counted afterwards: a loop over
    each of many short runs would end where no processor expects it.
    """
    number = lanes(SQUARES_Y)
    y = number * SIDE + np.int32(top)
    # pixel centres lie within 1.5 of its middle
    dy = f32(y) + (np.float32(0.5 * SIDE) - records[o + 10])
    d = maximum(absolute(dy) - np.float32(1.5), _ZERO)
    rest = _ONE - d * d * records[o + 11]
    wide = sqrt(maximum(rest * records[o + 13], _ZERO))
    wide += np.float32(1.5) * abs(records[o + 12])
    middle = dy * records[o + 12] + (records[o + 9] - np.float32(left))
    first = i32(minimum(maximum(middle - wide + _HALF, _ZERO), np.float32(TILE_WIDTH)))
    past = minimum(middle + wide - _HALF, np.float32(TILE_WIDTH - 1))
    last = i32(maximum(past, _ZERO))
    # not beyond the box, by whose blocks a surfel is left out
    first = maximum(first, np.int32(boxes[s, 0] - left))
    last = minimum(last, np.int32(boxes[s, 1] - left))
    met = (rest >= _ZERO) & (past >= _ZERO) & (first <= last)
    zero = full(np.int32(0), SQUARES_Y)
    first = select(met, first >> 2, zero)
    store(starts, 0, first + number * SQUARES_X)
    store(ends, 0, select(met, (last >> 2) + 1, zero) - first)
    high = max(boxes[s, 2] - top, 0) // SIDE
    low = min(boxes[s, 3] - top, TILE_HEIGHT - 1) // SIDE
    for row in range(high, low + 1):
        run = lanes(SQUARE) + starts[row]
        store(squares, at, run)
        if ends[row] > SQUARE:
            store(squares, at + SQUARE, run + SQUARE)
        at += ends[row]
    return at
