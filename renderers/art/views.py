"""What the ray kernels are shown: cells at hand, and how densities are classified."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class CellView(NamedTuple):
    """Show the kernels which cells are here.

    top: int32 (3,) largest cube index along x, y, z. counts: int32 (3,) cells along
    x, y, z. cell_leap: uint8 (cells,) Chebyshev distance in cells to the next cell
    with something in it. slots: int32 (cells,), negative when missing. samples:
    float32, flat, (value, gradient x y z) of ``(side + 1)**3`` voxels a slot.
    cube_leap: uint8, flat, ``side**3`` a slot. stamp: int64 (slots,) time of last use.
    """

    top: NDArray[np.int32]
    counts: NDArray[np.int32]
    cell_leap: NDArray[np.uint8]
    slots: NDArray[np.int32]
    samples: NDArray[np.float32]
    cube_leap: NDArray[np.uint8]
    stamp: NDArray[np.int64]


class Classification(NamedTuple):
    """Hold the user's own transfer-function nodes behind a table of bins.

    bins: int32 (b,) first segment that a bin can fall into; a bin is
    ``(v - low) * scale``. nodes: float32 (n + 1,) lower ends of segments, +inf last.
    base, slope: float32 (n, 4) colour and extinction per mm, and their slopes.
    """

    bins: NDArray[np.int32]
    low: np.float32
    scale: np.float32
    nodes: NDArray[np.float32]
    base: NDArray[np.float32]
    slope: NDArray[np.float32]
