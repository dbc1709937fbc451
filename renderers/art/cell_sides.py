"""How large cells are: quick where there is room, lean where there is not."""

import math

SMALLEST_SIDE = 8
SIDES = (SMALLEST_SIDE, 16, 32)

ROOMY_BYTES = 256 << 20
"""A lit copy of a volume that takes no more has the quickest cells, the smallest. Cells
of 32 took 6 to 11 % more time than those of 8 at 128 and 256 voxels along an edge."""

LIT_BYTES = 8
"""Of a voxel in a brick: value and gradient, int16 each."""


def brick_voxels(shape: tuple[int, int, int], side: int) -> int:
    """Count the voxels of a volume's bricks when all of its cells are met.

    A brick has a voxel more along each edge than its cell, and cells stand out beyond
    the volume's end.
    """
    return (side + 1) ** 3 * math.prod(-(-n // side) for n in shape)


def leanest_side(shape: tuple[int, int, int]) -> int:
    """Choose the side of cells whose bricks take the least when all are met."""
    return min(SIDES, key=lambda side: brick_voxels(shape, side))


def side_for(shape: tuple[int, int, int]) -> int:
    """Choose the side of cells for a lit volume on one machine."""
    if LIT_BYTES * brick_voxels(shape, SMALLEST_SIDE) <= ROOMY_BYTES:
        return SMALLEST_SIDE
    return leanest_side(shape)
