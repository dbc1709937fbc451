"""Memory in which splats of mode `classic` are projected and tiles drawn."""

import numpy as np

from renderers.fsr.kernels.depth_sort import KEYS
from renderers.fsr.kernels.project_splats import RECORD
from renderers.fsr.splats.splat_tiles import BLOCKS, SQUARE, SQUARES, STATE
from renderers.fsr.surfels.surfel_buffers import lined_up

_SPARE = 16
"""Elements behind the last, which vectors may write to."""


class SplatRoom:
    """Hold what becomes of the splats of one piece, for so many of them.

    all_: index, keys, records, boxes, ranges, counts and entries, see `draw_pieces`.
    """

    def __init__(self, splats: int) -> None:
        self.splats = splats
        room = splats + _SPARE
        index, keys, ranges = (np.empty(room, np.int32) for _ in range(3))
        records = lined_up(room * RECORD).reshape(-1, RECORD)
        boxes = lined_up(room * 4, np.int32).reshape(-1, 4)
        counts = np.zeros(KEYS, np.int32)
        entries = np.zeros(room, np.int64)
        self.all_ = index, keys, records, boxes, ranges, counts, entries


class TileScratch:
    """Hold what one thread needs of the tile it draws, for pieces of so many splats.

    all_: items, ``(8, n)`` lists of splats; limits, a float a pixel; sums, four of a
    sheet; sheets and far, one a square.
    """

    def __init__(self, splats: int) -> None:
        items = np.empty((8, splats + _SPARE), np.int32)
        limits = lined_up(SQUARES * SQUARE)
        sums = lined_up(SQUARES * STATE)
        sheets = lined_up(SQUARES, np.int32)
        self.all_ = items, limits, sums, sheets, lined_up(SQUARES)


class TileStates:
    """Hold the tiles of a picture between one piece of its splats and the next.

    all_: states, ``(tiles, 4 floats a pixel)``, light and colours; depths, ``(tiles,
    one a pixel)``, or none; alive, ``(tiles,)`` int64, the squares that take light, a
    bit each; drawn, ``(tiles,)`` int64, squares whose state is written, of tiles that
    are opened; fresh, ``(tiles,)``, those that are not; one number for turns; waiting,
    see `find_waiting`.
    """

    def __init__(self, down: int, across: int, with_depth: bool) -> None:
        tiles = down * across
        self.shape = down, across, with_depth
        states = lined_up(tiles * SQUARES * STATE).reshape(tiles, -1)
        each = SQUARES * SQUARE if with_depth else 0
        depths = lined_up(tiles * each).reshape(tiles, each)
        alive, drawn = np.zeros((2, tiles), np.int64)
        fresh = np.ones(tiles, np.bool_)
        turns = np.zeros(1, np.int64)
        blocks = (BLOCKS * down + 2) * (BLOCKS * across + 2)
        waiting = np.empty(blocks + (down + 2) * (across + 2), np.int32)
        self.all_ = states, depths, alive, drawn, fresh, turns, waiting

    def begin(self, strip: range) -> None:
        """Begin another picture, of which these tiles are wanted."""
        _, _, alive, _, fresh, _, _ = self.all_
        alive[:] = 0
        alive[strip.start : strip.stop] = -1
        fresh[:] = True
