"""How large cells are: quick where there is room, lean where there is not."""

import math

SMALLEST_SIDE = 8
QUICK_SIDE = 16
SIDES = (SMALLEST_SIDE, QUICK_SIDE, 32)
"""With cells of 16 a lit volume's first picture takes a sixth to nearly a half less
time than with cells of 8, and others as long (.95 to 1.06 times); cells of 32 take 9 to
13 % more where all are met."""

MANY = 4096
"""Cells that a rank has room for at least, where they are larger than the smallest."""

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


def sent_side(memory_bytes: int | None) -> int:
    """Choose the side of a lit volume's cells that ranks send to each other.

    Each takes the same steps, however large it is: two ranks' first picture of 384
    cubed took 4.7 s with cells of 8, 1.8 with 16 and 1.4 with 32. memory_bytes: of
    `CellPolicy`; all ranks must choose alike, and know no more of each other.
    """
    if memory_bytes is None:
        return SIDES[-1]
    bricks = [LIT_BYTES * (side + 1) ** 3 for side in SIDES]
    room = [MANY * brick <= memory_bytes for brick in bricks]
    return SIDES[max(sum(room) - 1, 0)]


def side_for(shape: tuple[int, int, int], seen: int) -> int:
    """Choose the side of cells for a lit volume on one machine.

    seen: cells of `QUICK_SIDE` that may hold something to be seen.
    """
    voxels = math.prod(shape)
    quick = LIT_BYTES * (QUICK_SIDE + 1) ** 3 * (seen + 1) + voxels
    return QUICK_SIDE if quick <= MOST_A_VOXEL * voxels else leanest_side(shape)
