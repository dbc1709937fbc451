"""How a tile of the picture lies in memory, for those who draw it.

A tile is cut into squares of 4 x 4 pixels, row by row; the sixteen floats of one
quantity in a square are neighbours, and so are all quantities of a square. A disc
then touches few and whole cache lines, and a square is one vector.
"""

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

MOST_TILES = 255
"""Tiles along a side of a picture: a surfel's range of them takes four bytes."""
