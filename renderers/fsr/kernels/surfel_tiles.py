"""How a tile of a G-buffer lies in memory while surfels are drawn into it.

A tile is cut into squares of 4 x 4 pixels, row by row; the sixteen floats of one
quantity in a square are neighbours, and so are all quantities of a square. A disc
then touches few and whole cache lines, and a square is one vector.
"""

import numpy as np
from numpy.typing import NDArray

TILE_SHIFT_X = 7
TILE_SHIFT_Y = 6
TILE_WIDTH = 1 << TILE_SHIFT_X
TILE_HEIGHT = 1 << TILE_SHIFT_Y

SIDE = 4
"""Pixels along a side of a square."""

SQUARE = SIDE * SIDE
SQUARES_X = TILE_WIDTH // SIDE
SQUARES_Y = TILE_HEIGHT // SIDE
SQUARES = SQUARES_X * SQUARES_Y

SPARE_SQUARES = SQUARES + 2 * SQUARE
"""Room that one more disc needs in a list of squares: all of them, and what its last
vector writes beyond."""

RAY = 3 * SQUARE
"""Floats of a square's rays: x, y, z in the camera frame."""

SUMS = 5 * SQUARE
"""Floats of a square's sums: w, w t, w nx, w ny, w nz."""

BLOCK = 16
"""Side in pixels of the blocks whose farthest depth turns hidden surfels down."""

BLOCK_SQUARES = BLOCK // SIDE
BLOCKS_X = TILE_WIDTH // BLOCK
BLOCKS_Y = TILE_HEIGHT // BLOCK
BLOCKS = BLOCKS_X * BLOCKS_Y

MOST_TILES = 127
"""Tiles along a side of a picture: a surfel's range of them takes four times seven
bits (16,256 x 8,128 pixels)."""


def tile_by_tile(
    table: NDArray[np.float32], down: int, across: int
) -> NDArray[np.float32]:
    """Lay the rays ``(h, w, 3)`` of a picture out as ``(tiles, SQUARES * RAY)``.

    Per square x, y and z of its pixels; zero beyond the picture.
    """
    height, width = table.shape[:2]
    padded = np.zeros((down * TILE_HEIGHT, across * TILE_WIDTH, 3), np.float32)
    padded[:height, :width] = table
    squares = padded.reshape(down, SQUARES_Y, SIDE, across, SQUARES_X, SIDE, 3)
    # to tile row, tile column, square row, square, channel, row, column
    laid = squares.transpose(0, 3, 1, 4, 6, 2, 5)
    return laid.reshape(down * across, SQUARES * RAY)
