"""Memory in which tiles of mode `classic` are drawn."""

import numpy as np
from numpy.typing import NDArray

from renderers.fsr.classic.shells.kernels import find_waiting
from renderers.fsr.classic.tiles import BLOCKS, SQUARE, SQUARES, STATE
from renderers.fsr.scope.scratch import lined_up


class TileScratch:
    """Hold what one thread needs of the tile it draws.

    items: ``(8, n)`` room for lists of splats. limits: a float a pixel. sums: four of a
    sheet. sheets, far: one a square.
    """

    def __init__(self, splats: int) -> None:
        self.items: NDArray[np.int32] = np.empty((8, splats), np.int32)
        self.limits: NDArray[np.float32] = lined_up(SQUARES * SQUARE)
        self.sums: NDArray[np.float32] = lined_up(SQUARES * STATE)
        self.sheets: NDArray[np.int32] = lined_up(SQUARES, np.int32)
        self.far: NDArray[np.float32] = lined_up(SQUARES)


class TileStates:
    """Hold the tiles of a picture between one piece of its splats and the next.

    states: ``(tiles, 4 floats a pixel)`` light and colours. depths: ``(tiles, one a
    pixel)``, or none. alive: ``(tiles,)`` int64, the squares that take light, a bit
    each; all, until a tile is opened. fresh: ``(tiles,)``, those that are not. drawn:
    ``(tiles,)`` int64, squares whose state is written; of tiles that are opened.
    """

    def __init__(self, down: int, across: int, with_depth: bool) -> None:
        tiles = down * across
        self.shape = down, across, with_depth
        self.states: NDArray[np.float32] = lined_up(tiles * SQUARES * STATE)
        self.states = self.states.reshape(tiles, -1)
        depths = SQUARES * SQUARE if with_depth else 0
        self.depths: NDArray[np.float32] = lined_up(tiles * depths)
        self.depths = self.depths.reshape(tiles, depths)
        self.alive: NDArray[np.int64] = np.empty(tiles, np.int64)
        self.drawn: NDArray[np.int64] = np.zeros(tiles, np.int64)
        self.fresh: NDArray[np.bool_] = np.empty(tiles, np.bool_)
        self.begin()

    def begin(self) -> None:
        """Begin another picture."""
        self.alive[:] = -1
        self.fresh[:] = True

    def waiting_sets(self) -> NDArray[np.int32]:
        """Tell where light is taken, see `find_waiting`."""
        down, across, _ = self.shape
        blocks = (BLOCKS * down + 2) * (BLOCKS * across + 2)
        size = blocks + (down + 2) * (across + 2)
        result: NDArray[np.int32] = np.empty(size, np.int32)
        find_waiting(self.alive, down, across, result)
        return result
