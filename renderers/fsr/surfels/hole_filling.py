"""Holes of a splatted picture filled from their neighbours."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from renderers.fsr.kernels.holes import close_holes, find_holes
from renderers.fsr.kernels.surfel_tiles import TILE_HEIGHT, TILE_WIDTH
from renderers.scene import GBuffer
from renderers.scene.thread_pool import ThreadPool

HOLE_NEIGHBOURS = 5
"""Neighbours an empty pixel needs to count as a hole rather than as open air."""


def fill_holes(
    rays: NDArray[np.float32],
    result: GBuffer,
    tiles: Sequence[tuple[int, int]],
    pool: ThreadPool,
) -> int:
    """Fill holes of `result` with the mean of their neighbours; return their number.

    rays: ``(h, w, 3)``, zero where the lens sees nothing. tiles: rows and columns of
    those that have empty pixels. All means are taken before any is written, so the
    order does not matter, nor the size of the pool.
    """
    size = TILE_HEIGHT * TILE_WIDTH
    # pages of which nothing is used cost nothing
    where = np.empty((len(tiles), size, 2), np.int32)
    found = np.empty((len(tiles), size, 4), np.float32)

    def find(index: int) -> int:
        row, column = tiles[index]
        return int(
            find_holes(
                rays,
                result.depth_mm,
                result.normal,
                result.coverage,
                HOLE_NEIGHBOURS,
                (row * TILE_HEIGHT, (row + 1) * TILE_HEIGHT),
                (column * TILE_WIDTH, (column + 1) * TILE_WIDTH),
                where[index],
                found[index],
            )
        )

    counts = pool.map(find, range(len(tiles)))
    for index, count in enumerate(counts):
        close_holes(
            where[index],
            found[index],
            count,
            result.depth_mm,
            result.normal,
            result.coverage,
        )
    return sum(counts)
