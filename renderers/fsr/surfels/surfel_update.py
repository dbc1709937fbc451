"""Surfels of single blocks extracted anew, after an edit of the distance field."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderers.fsr.kernels.extract_surfels import (
    MARGIN,
    FoundBlocks,
    FoundSurfels,
    GradientCache,
    extract_surfel_blocks,
)
from renderers.fsr.kernels.gradients import FlatVolume
from renderers.fsr.sobel_normals import flat_volume
from renderers.fsr.surfels.surfel_pool import SurfelPool
from renderers.fsr.surfels.surfel_set import grown, look_at, make_cache
from renderers.scene import Change, Volume

_MOST_PLANES = 128
"""Planes of gradients that are kept, at most: all that a tool changes at once, so that
fine surfels find those of coarse ones."""

_CACHED = math.ceil(MARGIN) + 5
"""Voxels around a change in which gradients are kept: blocks begin up to three before
the margin, and Newton's steps and a cell's end go on from there."""

_FIRST_ROOM = 8192


class BlockSurfels(NamedTuple):
    """Surfels of some blocks, block by block.

    counts, rows: ``(b,)`` int64 of each block, see `BlockSpans`. position, normal: at
    least as many rows as there are surfels; they hold until blocks are looked at again.
    far: elements in these blocks that depend on values far away, see `FoundSurfels`.
    """

    counts: NDArray[np.int64]
    rows: NDArray[np.int64]
    position: NDArray[np.float32]
    normal: NDArray[np.float32]
    far: NDArray[np.int64]


class BlockExtraction:
    """Extract the surfels of blocks; keeps its scratch memory from edit to edit."""

    def __init__(self) -> None:
        self._found: dict[int, FoundSurfels] = {}

    def find(
        self,
        distance: Volume,
        pools: tuple[SurfelPool, ...],
        places: NDArray[np.int64],
        change: Change,
    ) -> list[BlockSurfels]:
        """Find the surfels of each set in blocks at places (i, j, k), ``(b, 3)``."""
        first = np.maximum(change.low - _CACHED, 0)
        end = np.minimum(change.high + _CACHED + 1, distance.shape[::-1])
        (i, j, _), (width, height, depth) = first.tolist(), (end - first).tolist()
        planes = min(1 << max(depth - 1, 1).bit_length(), _MOST_PLANES)
        cache = make_cache(planes, (height, width), (j, i))
        volume = flat_volume(distance)
        return [self._find(distance, volume, pool, places, cache) for pool in pools]

    def _find(
        self,
        distance: Volume,
        volume: FlatVolume,
        pool: SurfelPool,
        places: NDArray[np.int64],
        cache: GradientCache,
    ) -> BlockSurfels:
        counted = FoundBlocks(
            np.empty(len(places), np.int64), np.empty(len(places), np.int64)
        )
        found = self._found.get(pool.shift) or FoundSurfels(
            np.empty(0, np.uint16),
            np.empty((_FIRST_ROOM, 3), np.float32),
            np.empty((_FIRST_ROOM, 3), np.float32),
            np.empty((_FIRST_ROOM, 4), np.int64),
        )
        look = look_at(distance, volume, pool.refine, cache)
        while True:
            self._found[pool.shift] = found
            count, far = extract_surfel_blocks(
                look, places, 1 << pool.shift, found, counted
            )
            if count >= 0:
                return BlockSurfels(
                    *counted, found.position, found.normal, found.far[:far].copy()
                )
            found = grown(found)


def far_blocks(pool: SurfelPool, change: Change) -> NDArray[np.int64]:
    """Return the places of blocks that a change reaches though it is far from them.

    They hold an element that Newton's steps lead far away; ``(b, 3)``, (i, j, k).
    """
    at, way = pool.far[:, :3], pool.far[:, 3:]
    reach = way + math.ceil(MARGIN)
    is_met = (at // pool.refine - reach <= change.high) & (
        at // pool.refine + reach >= change.low
    )
    return at[is_met.all(axis=1)] >> pool.shift
