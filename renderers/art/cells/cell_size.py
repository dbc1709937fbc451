"""How large cells are: quick where there is room, lean where there is not."""

import math

SMALLEST_SIDE = 8
QUICK_SIDE = 16
SIDES = (SMALLEST_SIDE, QUICK_SIDE, 32)
"""With cells of 16 a lit volume's first picture takes a sixth to nearly a half less
time than with cells of 8, and others as long (.95 to 1.06 times); cells of 32 take 9 to
13 % more where all are met."""

LIT_BYTES = 8
"""Of a voxel in a brick: value and gradient, int16 each."""

MOST_A_VOXEL = 10
"""Bytes of a lit volume's copy; the quick cells take 10.6 where all may be met."""


def brick_voxels(shape: tuple[int, int, int], side: int) -> int:
    """Count the voxels of a volume's bricks when all of its cells are met.

    A brick has a voxel more along each edge than its cell, and cells stand out beyond
    the volume's end.
    """
    return (side + 1) ** 3 * math.prod(-(-n // side) for n in shape)


def leanest_side(shape: tuple[int, int, int]) -> int:
    """Choose the side of cells whose bricks take the least when all are met."""
    return min(SIDES, key=lambda side: brick_voxels(shape, side))


def side_for(shape: tuple[int, int, int], seen: int) -> int:
    """Choose the side of cells for a lit volume on one machine.

    seen: cells of `QUICK_SIDE` that may hold something to be seen.
    """
    voxels = math.prod(shape)
    quick = LIT_BYTES * (QUICK_SIDE + 1) ** 3 * (seen + 1) + voxels
    return QUICK_SIDE if quick <= MOST_A_VOXEL * voxels else leanest_side(shape)
