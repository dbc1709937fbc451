"""What there is memory for: all that is drawn with, or as many cells as fit."""

import math
from dataclasses import dataclass

from system import UserError

LEAST_CELLS = 64
"""Ready at a time; with fewer, rays side by side would take cells from each other."""


@dataclass(frozen=True, slots=True)
class MemoryBudget:
    """Share out memory.

    cells: kept ready, the volume's others are made anew when they are needed; None for
    all. whole: a copy of the volume is kept, too.
    """

    cells: int | None
    whole: bool


def require_distances(shape: tuple[int, int, int], limit: int) -> None:
    """Raise UserError where the distances over empty space alone take too much."""
    need = math.prod(shape)
    if need > limit:
        raise UserError(
            f"drawing a volume of {_size(shape)} voxels needs {need:,} bytes for its "
            f"empty space alone and at most {limit:,} may be taken; draw a part of it, "
            "or allow more by memory_bytes"
        )


def require_cache(cells: int, brick_bytes: int, limit: int) -> None:
    """Raise UserError where a number of cells that was asked for takes too much."""
    need = (cells + 1) * brick_bytes
    if need > limit:
        raise UserError(
            f"keeping {cells:,} cells takes {need:,} bytes and at most {limit:,} may "
            "be taken; keep fewer, or all that there is room for by naming no number"
        )


def budget_for(
    shape: tuple[int, int, int],
    seen: int,
    brick_bytes: int,
    whole_bytes: int,
    limit: int,
    *,
    bricks: bool,
) -> MemoryBudget:
    """Fit what a volume is drawn with into `limit` bytes.

    seen: cells that may hold something to be seen. brick_bytes: of a cell's brick.
    whole_bytes: of a copy of the volume, 0 where none is wanted. bricks: they are
    wanted beside such a copy. Raise UserError where not even a few cells fit.
    """
    left = limit - math.prod(shape)
    # one brick more serves all empty cells
    every = (seen + 1) * brick_bytes
    if whole_bytes and whole_bytes + bricks * every <= left:
        return MemoryBudget(None, True)
    if (bricks or not whole_bytes) and every <= left:
        return MemoryBudget(None, False)
    cells = left // brick_bytes - 1
    if cells < min(seen, LEAST_CELLS):
        need = math.prod(shape) + (min(seen, LEAST_CELLS) + 1) * brick_bytes
        raise UserError(
            f"drawing a volume of {_size(shape)} voxels needs at least {need:,} bytes "
            f"and at most {limit:,} may be taken; draw a part of it, or allow more by "
            "memory_bytes"
        )
    return MemoryBudget(max(min(cells, seen), 1), False)


def _size(shape: tuple[int, int, int]) -> str:
    return " x ".join(map(str, shape[::-1]))
