"""Surfels sorted by the blocks that are culled whole."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from renderers.fsr.surfels.occlusion_blocks import BlockOrder, Blocks
from renderers.fsr.surfels.surfel_set import Surfels

_SPARE = 16
"""Rows after the last: vectors load sixteen at a time."""


@dataclass(frozen=True, slots=True)
class BlockedSurfels:
    """Hold surfels block by block, in grid order within a block.

    position, normal: ``(n + 16, 3)`` float32 as in `Surfels`. order: where each block
    begins. first_mm: world position of the grid's first point, from which positions
    are counted. spacing_mm: as in `Surfels`.
    """

    position: NDArray[np.float32]
    normal: NDArray[np.float32]
    order: BlockOrder
    first_mm: NDArray[np.float64]
    spacing_mm: float

    def __len__(self) -> int:
        return len(self.order.index)


def sort_surfels(surfels: Surfels, blocks: Blocks, shift: int) -> BlockedSurfels:
    """Sort; a block has ``2**shift`` of the surfels' voxels a side."""
    order = blocks.sort(surfels.rows, shift)
    position, normal = (
        np.concatenate([array[order.index], np.ones((_SPARE, 3), np.float32)])
        for array in (surfels.position, surfels.normal)
    )
    first_mm = surfels.rows.world_from_voxel[:3, 3]
    return BlockedSurfels(position, normal, order, first_mm, surfels.spacing_mm)
