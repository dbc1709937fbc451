"""Memory in which tiles of mode `classic` are drawn."""

import numpy as np
from numpy.typing import NDArray

from renderers.fsr.classic.tiles import SQUARE, SQUARES, STATE
from renderers.fsr.scope.scratch import lined_up

RUN = 8
"""Tiles side by side that one thread draws at a time."""


class TileScratch:
    """Hold what one thread needs of the tile it draws.

    items: ``(3, n)`` room for lists of splats. limits: a float a pixel. sums: four of a
    sheet. sheets, far: one a square.
    """

    def __init__(self, splats: int) -> None:
        self.items: NDArray[np.int32] = np.empty((3, splats), np.int32)
        self.limits: NDArray[np.float32] = lined_up(SQUARES * SQUARE)
        self.sums: NDArray[np.float32] = lined_up(SQUARES * STATE)
        self.sheets: NDArray[np.int32] = lined_up(SQUARES, np.int32)
        self.far: NDArray[np.float32] = lined_up(SQUARES)


class TileStates:
    """Hold the tiles of a picture between one piece of its splats and the next.

    states: ``(tiles, 4 floats a pixel)`` light and colours. depths: ``(tiles, one a
    pixel)``, or none. alive: ``(tiles,)`` int64, the squares that take light, a bit
    each; all, until a tile is opened.
    """

    def __init__(self, down: int, across: int, with_depth: bool) -> None:
        tiles = down * across
        self.shape = down, across, with_depth
        self.states: NDArray[np.float32] = lined_up(tiles * SQUARES * STATE)
        self.states = self.states.reshape(tiles, -1)
        depths = SQUARES * SQUARE if with_depth else 0
        self.depths: NDArray[np.float32] = lined_up(tiles * depths)
        self.depths = self.depths.reshape(tiles, depths)
        self.alive: NDArray[np.int64] = np.full(tiles, -1, np.int64)

    def runs(self) -> list[tuple[int, int]]:
        """List first and last + 1 of tiles that are drawn at a time, in one row each.

        Rows that take no more light are left out.
        """
        down, across, _ = self.shape
        starts = range(0, across, RUN)
        every = [
            (row * across + start, row * across + min(start + RUN, across))
            for row in range(down)
            for start in starts
        ]
        return [(first, end) for first, end in every if self.alive[first:end].any()]

    def waiting_sets(self) -> NDArray[np.int32]:
        """Give ``(down + 3, across + 3)`` sets of tiles that take light, as bits.

        See `take_shell`.
        """
        down, across, _ = self.shape
        one = np.zeros((down + 4, across + 4), np.int32)
        one[1 : down + 1, 1 : across + 1] = self.alive.reshape(down, across) != 0
        beside = one[:, :-1] | one[:, 1:]
        below = one[:-1, :-1] | one[1:, :-1]
        all_ = beside[:-1] | beside[1:]
        return one[:-1, :-1] | beside[:-1] << 1 | below << 2 | all_ << 3
