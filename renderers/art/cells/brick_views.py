"""What the ray kernels are shown: cells at hand, and how densities are classified."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

ABSENT = np.int32(-(1 << 31))

TILE_PX = 8
"""Edge of the squares of pixels whose rays march together: they share cells."""

BLOCK_COLUMNS = 256
"""Pixels along a row of tiles whose rays are set up together."""


class CellView(NamedTuple):
    """Show the kernels which cells are here.

    top: int32 (3,) largest cube index along x, y, z. counts: int32 (3,) cells along
    x, y, z. leap: uint8, flat, every cube's Chebyshev distance in cubes to the next
    with something in it, and three bytes to spare. slots: int32 (cells,), negative
    when missing. corners: int32 (cells,), the number that voxel (0, 0, 0) would have
    among the samples if a cell's brick went on to it; ABSENT when missing. samples:
    flat, float32 or int16, ``(side + 1)**3`` voxels a slot. channels: numbers a voxel,
    4 (value, gradient x y z) or 1 (value) where no sample is shaded. whole: the
    volume's values, flat, where they are read without looking a cell up; else empty.
    unit: what an interpolated value is multiplied by.
    gradient_unit: likewise, to be per mm. stamp: int64 (slots,) time of last use.
    """

    top: NDArray[np.int32]
    counts: NDArray[np.int32]
    leap: NDArray[np.uint8]
    slots: NDArray[np.int32]
    corners: NDArray[np.int32]
    samples: NDArray[Any]
    channels: int
    whole: NDArray[Any]
    unit: np.float32
    gradient_unit: np.float32
    stamp: NDArray[np.int64]


class Classification(NamedTuple):
    """Hold a transfer function as bins, each a straight line between its ends.

    A density v falls into bin ``(v - low) * scale + 1``; bin 0 is all below, bin `last`
    all above. lines: float32 (bins, 8): extinction per mm, its rise, red, its rise,
    green, its rise, blue, its rise; rises are per bin. Bins that hold one of the
    user's nodes between their ends have a negative extinction; there the segments
    between nodes count: first: int32 (bins,) the segment at a bin's
    lower end; extinction: float32 (n, 4) lower end of a segment, its upper end (+inf
    last), extinction per mm there, its slope. color, color_slope: float32 (n, 4)
    likewise; the last column is spare.
    """

    lines: NDArray[np.float32]
    low: np.float32
    scale: np.float32
    last: np.float32
    first: NDArray[np.int32]
    extinction: NDArray[np.float32]
    color: NDArray[np.float32]
    color_slope: NDArray[np.float32]
