"""Memory in which one thread draws its tiles of mode `classic`."""

import numpy as np
from numpy.typing import NDArray

from renderers.fsr.classic.tiles import SQUARE, SQUARES, STATE
from renderers.fsr.scope.scratch import lined_up


class TileScratch:
    """Hold a tile's light and colours, its depth, and a sheet being summed.

    state, sums: four floats a pixel. depths, limits: one. sheets, far: one a square.
    """

    def __init__(self) -> None:
        self.state: NDArray[np.float32] = lined_up(SQUARES * STATE)
        self.sums: NDArray[np.float32] = lined_up(SQUARES * STATE)
        self.depths: NDArray[np.float32] = lined_up(SQUARES * SQUARE)
        self.limits: NDArray[np.float32] = lined_up(SQUARES * SQUARE)
        self.far: NDArray[np.float32] = lined_up(SQUARES)
        self.sheets: NDArray[np.int32] = lined_up(SQUARES, np.int32)
