"""Memory in which one thread draws its tiles."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderers.fsr.surfels.surfel_tiles import (
    BLOCKS,
    SPARE_SQUARES,
    SQUARE,
    SQUARES,
    SQUARES_Y,
    SUMS,
)

_LINE = 64

MOST_SQUARES = 1 << 15
"""Squares of a tile's surfels that are remembered; those of a tile in the default head
are 10,000 to 20,000. Further ones are found twice."""


def lined_up(count: int, dtype: Any = np.float32) -> NDArray[Any]:
    """Give zeros that begin on a cache line: vectors across two cost a third more."""
    size = count * np.dtype(dtype).itemsize
    memory = np.zeros(size + _LINE, np.uint8)
    first = -memory.ctypes.data % _LINE
    return memory[first : first + size].view(dtype)


class TileScratch:
    """Hold a tile's nearest cores, its sums and its list of surfels.

    items: room for the surfels of a tile. nearest: a value per pixel. sums: five per
    pixel. far: one per block. starts, ends: one per row of squares. squares, until:
    the squares of one surfel after another, and where those of each end.
    """

    def __init__(self, items: int) -> None:
        self.items: NDArray[np.int32] = np.empty(items, np.int32)
        self.until: NDArray[np.int32] = np.empty(items, np.int32)
        squares = MOST_SQUARES + SPARE_SQUARES
        self.squares: NDArray[np.int32] = lined_up(squares, np.int32)
        self.nearest: NDArray[np.float32] = lined_up(SQUARES * SQUARE)
        self.sums: NDArray[np.float32] = lined_up(SQUARES * SUMS)
        self.far: NDArray[np.float32] = lined_up(BLOCKS)
        self.starts: NDArray[np.int32] = lined_up(SQUARES_Y, np.int32)
        self.ends: NDArray[np.int32] = lined_up(SQUARES_Y, np.int32)
