"""How a tile of a picture of mode `classic` lies in memory while it is drawn.

A tile is cut into squares of 4 x 4 pixels, row by row; a square is one vector, and
what is left of the light and the three colours of its pixels are four cache lines. A
set of squares of a tile is one number of 64 bits.
"""

TILE_SHIFT = 5
TILE_SIDE = 1 << TILE_SHIFT

SIDE = 4
"""Pixels along a side of a square."""

SQUARE = SIDE * SIDE
ACROSS = TILE_SIDE // SIDE
"""Squares along a side of a tile."""

SQUARES = ACROSS * ACROSS

BLOCKS = ACROSS // 2
"""Blocks of two by two squares along a side of a tile."""

STATE = 4 * SQUARE
"""Floats of a square: the light still to come, then red, green, blue so far."""

RUN = 16
"""Tiles side by side that one thread draws at a time."""

MOST_TILES = 255
"""Tiles along a side of a picture: a splat's range of them takes four bytes."""
