"""Memory in which splats of mode `classic` are projected and tiles drawn."""

import numpy as np

from renderers.fsr.kernels.depth_sort import KEYS
from renderers.fsr.kernels.project_splats import RECORD, SplatBuffers
from renderers.fsr.kernels.tile_buffer import (
    BLOCKS,
    SQUARE,
    SQUARES,
    STATE,
    TileBuffer,
)
from renderers.fsr.surfels.surfel_buffers import lined_up

_SPARE = 16
"""Elements behind the last, which vectors may write to."""


def make_splat_buffers(splats: int) -> SplatBuffers:
    """Allocate memory for so many splats of one depth slab."""
    size = splats + _SPARE
    return SplatBuffers(
        np.empty(size, np.int32),
        np.empty(size, np.int32),
        lined_up(size * RECORD).reshape(-1, RECORD),
        lined_up(size * 4, np.int32).reshape(-1, 4),
        np.empty(size, np.int32),
        np.zeros(KEYS, np.int32),
        np.zeros(size, np.int64),
        np.empty((8, size), np.int32),
    )


def make_tile_buffer(down: int, across: int, with_depth: bool) -> TileBuffer:
    """Allocate memory for the tiles of a picture."""
    tiles = down * across
    each = SQUARES * SQUARE if with_depth else 0
    blocks = (BLOCKS * down + 2) * (BLOCKS * across + 2)
    return TileBuffer(
        lined_up(tiles * SQUARES * STATE).reshape(tiles, -1),
        lined_up(tiles * each).reshape(tiles, each),
        np.zeros(tiles, np.int64),
        np.zeros(tiles, np.int64),
        np.ones(tiles, np.bool_),
        np.zeros(1, np.int64),
        np.empty(blocks + (down + 2) * (across + 2), np.int32),
        lined_up(SQUARES * SQUARE),
    )


def begin_picture(tiles: TileBuffer, band: range) -> None:
    """Begin another picture, of which a band of tiles is wanted."""
    tiles.alive[:] = 0
    tiles.alive[band.start : band.stop] = -1
    tiles.fresh[:] = True
