"""Memory in which one thread draws its tiles."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderers.fsr.kernels.draw_surfels import SurfelScratch
from renderers.fsr.kernels.surfel_tiles import (
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
    """Return zeros that begin on a cache line: vectors across two cost a third more."""
    size = count * np.dtype(dtype).itemsize
    memory = np.zeros(size + _LINE, np.uint8)
    first = -memory.ctypes.data % _LINE
    return memory[first : first + size].view(dtype)


def make_surfel_scratch(items: int) -> SurfelScratch:
    """Allocate memory for tiles of so many surfels."""
    return SurfelScratch(
        np.empty(items, np.int32),
        np.empty(items, np.int32),
        lined_up(MOST_SQUARES + SPARE_SQUARES, np.int32),
        lined_up(SQUARES * SQUARE),
        lined_up(SQUARES * SUMS),
        lined_up(BLOCKS),
        lined_up(SQUARES_Y, np.int32),
        lined_up(SQUARES_Y, np.int32),
    )
