"""What the ray kernels are shown: cells at hand, and how densities are classified."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class CellView(NamedTuple):
    """Show the kernels which cells are here.

    top: int32 (3,) largest cube index along x, y, z. counts: int32 (3,) cells along
    x, y, z. leap: uint8, flat, every cube's Chebyshev distance in cubes to the next
    with something in it, and three bytes to spare. slots: int32 (cells,), negative
    when missing. samples: float32, flat, (value, gradient x y z) of ``(side + 1)**3``
    voxels a slot. stamp: int64 (slots,) time of last use.
    """

    top: NDArray[np.int32]
    counts: NDArray[np.int32]
    leap: NDArray[np.uint8]
    slots: NDArray[np.int32]
    samples: NDArray[np.float32]
    stamp: NDArray[np.int64]


class Classification(NamedTuple):
    """Hold the user's own transfer-function nodes behind a table of bins.

    bins: int32 (b,) first segment that a bin can fall into; a bin is
    ``(v - low) * scale``. extinction: float32 (n, 4) lower end of a segment, its upper
    end (+inf last), extinction per mm there, its slope. color, color_slope: float32
    (n, 4) likewise; the last column is spare.
    """

    bins: NDArray[np.int32]
    low: np.float32
    scale: np.float32
    extinction: NDArray[np.float32]
    color: NDArray[np.float32]
    color_slope: NDArray[np.float32]
