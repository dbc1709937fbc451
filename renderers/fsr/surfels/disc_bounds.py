"""Where the discs of every block of surfels are."""

import numpy as np
from numpy.typing import NDArray

from renderers.fsr.surfels.occlusion_blocks import Blocks
from renderers.fsr.surfels.surfel_pool import SurfelPool
from renderers.fsr.visibility import BlockBounds
from renderers.scene import Volume


def disc_bounds(
    sets: tuple[SurfelPool, ...],
    blocks: Blocks,
    distance: Volume,
    reach: float,
    near_mm: float,
) -> BlockBounds:
    """Bound the discs of each block, and what is within `near_mm` of them, in cells.

    sets: surfels of `blocks`. reach: radius of a disc per spacing.
    """
    count = len(blocks.numbers)
    low = np.full((count, 3), np.inf)
    high = np.full((count, 3), -np.inf)
    for surfels in sets:
        begins, ends, _ = surfels.spans
        counts = ends - begins
        where = np.repeat(np.arange(count), counts)
        index = np.arange(len(where)) + (begins - np.cumsum(counts) + counts)[where]
        # along the grid's axes
        place = surfels.position[index] @ distance.direction
        normal = surfels.normal[index] @ distance.direction
        lean = np.sqrt(np.maximum(1 - normal**2, 0))
        extent = reach * surfels.spacing_mm * lean + near_mm
        _widen(low, -1, where, place - extent)
        _widen(high, 1, where, place + extent)
    spacing = distance.spacing_mm
    top = np.array(distance.shape[::-1]) - 2
    first = np.clip(np.floor(low / spacing), 0, top)
    last = np.clip(np.floor(high / spacing), 0, top)
    cells = np.concatenate([first, last], axis=1).astype(np.int64)
    return BlockBounds(blocks.numbers, blocks.places, cells)


def _widen(
    bound: NDArray[np.float64],
    sign: int,
    where: NDArray[np.int64],
    points: NDArray[np.float64],
) -> None:
    """Move bounds out to sorted points; sign: 1 for upper bounds."""
    if len(where) == 0:
        return
    begins = np.flatnonzero(np.append(True, np.diff(where) != 0))
    most = sign * np.maximum.reduceat(sign * points, begins)
    at = where[begins]
    bound[at] = sign * np.maximum(sign * bound[at], sign * most)
