"""Potentially visible sets: which blocks of surfels an eye may see from where.

The grid is cut into boxes of eight cells a side. For each box inside the airway the
cells in sight are flooded (see `kernels`), and the blocks with a disc near any of them
are kept: a set that no eye in the box sees more than. One look-up then does what
tracing cones does frame by frame, and leaves out more: floods from a box stop at walls
too thin for a cone to end in.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from renderers.fsr.kernels.visibility_floods import mark_met
from renderers.fsr.visibility.floods import AirCells, BoxFlood, find_air
from renderers.scene import Volume
from renderers.scene.thread_pool import ThreadPool

EDGE = 8
"""Cells along a side of a box, 4 mm at 0.5 mm. Half as many keep .97 as many blocks
and make eight times the boxes."""

WALLED_SIDES = 4
"""An airway has tissue on this many sides of six at least. Air in front of the face
has less, and eyes there see most of what there is."""

GROUP_SHIFT = 2

Progress = Callable[[float], None]


@dataclass(frozen=True, slots=True)
class BlockBounds:
    """Where the discs of every block of surfels may be.

    numbers: ``(b,)`` int32, the blocks' places on their grid, increasing. places:
    ``(b, 3)`` int64, the same as coordinates. cells: ``(b, 6)`` int64, first and last
    cell (i, j, k) that any of a block's discs comes near to.
    """

    numbers: NDArray[np.int32]
    places: NDArray[np.int64]
    cells: NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class VisibleSets:
    """Hold, per box inside the airway, which blocks an eye in it may see.

    shape: number of boxes ``(nz, ny, nx)``. table: ``(nz * ny * nx,)`` int32, a box's
    row of `bits`, -1 for boxes without one. numbers: as in `BlockBounds`. bits: ``(n,
    bytes)`` uint8, a bit per block, lowest first.
    """

    shape: tuple[int, int, int]
    table: NDArray[np.int32]
    numbers: NDArray[np.int32]
    bits: NDArray[np.uint8]

    def row(self, voxel: NDArray[np.float64]) -> int:
        """Return the row of the box around a grid place (i, j, k); -1 if there is none.

        The place must be in air for the set to hold.
        """
        box = np.floor(voxel / EDGE).astype(np.int64)[::-1]
        if np.any(box < 0) or np.any(box >= self.shape):
            return -1
        _, ny, nx = self.shape
        return int(self.table[(box[0] * ny + box[1]) * nx + box[2]])

    def seen(self, row: int) -> NDArray[np.uint8]:
        """Return 1 for every block that may be seen, 0 for the others."""
        return np.unpackbits(self.bits[row], count=len(self.numbers), bitorder="little")

    @property
    def share(self) -> float:
        """Return the mean share of the blocks that a set holds."""
        if self.bits.size == 0:
            return 1.0
        return float(
            np.bitwise_count(self.bits).sum() / len(self.bits) / len(self.numbers)
        )


class VisibleSetLookup:
    """Look up what an eye may see; the last answer is kept, since eyes move slowly.

    numbers: of the blocks that are asked about. Raises ValueError for sets of others.
    """

    def __init__(
        self, sets: VisibleSets, distance: Volume, numbers: NDArray[np.int32]
    ) -> None:
        if not np.array_equal(sets.numbers, numbers):
            raise ValueError(
                f"the visible sets are of {len(sets.numbers)} other blocks than the "
                f"{len(numbers)} of this surface; build or update them for it"
            )
        self._sets = sets
        self._distance = distance
        self._voxel_from_world = distance.voxel_from_world
        self._row = -1
        self._seen: NDArray[np.uint8] | None = None
        self._numbers = numbers
        self._stale = np.zeros(len(sets.numbers), np.bool_)
        self._changed = np.zeros(len(sets.numbers), np.bool_)
        self._is_edited = False

    def update(
        self,
        numbers: NDArray[np.int32],
        near: NDArray[np.int64],
        changed: NDArray[np.int64],
    ) -> None:
        """Follow an edit of the surface, after which there are other blocks.

        numbers: of the blocks that there are now. near: numbers of blocks around what
        was edited. Where none of these is in a set, floods from its box reach nothing
        that became different, and the set holds; of other boxes nothing is known from
        now on. changed: numbers of blocks with other surfels, which are always shown.
        """
        self._numbers = numbers
        self._stale |= np.isin(self._sets.numbers, near)
        self._changed |= np.isin(self._sets.numbers, changed)
        self._row = -1
        self._is_edited = True

    def seen_from(self, eye_mm: NDArray[np.float64]) -> NDArray[np.uint8] | None:
        """Return 1 per block that may be seen, else 0; None where nothing is known.

        That is outside the airway, in tissue, and where an edit may be seen.
        """
        matrix = self._voxel_from_world
        at = matrix[:3, :3] @ eye_mm + matrix[:3, 3]
        row = self._sets.row(at)
        if row < 0 or self._distance.at_voxel(at) >= 0:
            return None
        if row != self._row:
            self._row, self._seen = row, self._still_seen(row)
        return self._seen

    def _still_seen(self, row: int) -> NDArray[np.uint8] | None:
        seen = self._sets.seen(row)
        if not self._is_edited:
            return seen
        if np.any(seen[self._stale]):
            return None
        # what an edit brought about, or left, is not in sight; to show it is no fault
        known = np.searchsorted(self._sets.numbers, self._numbers)
        known = np.minimum(known, len(seen) - 1)
        is_new = (self._sets.numbers[known] != self._numbers) | self._changed[known]
        result = np.where(is_new, 1, seen[known]).astype(np.uint8)
        return result


def build_visible_sets(
    distance: Volume,
    bounds: BlockBounds,
    pool: ThreadPool,
    progress: Progress | None = None,
) -> VisibleSets:
    """Find the sets of all boxes inside the airway; seconds to minutes.

    distance: signed, negative in air.
    """
    air = find_air(distance)
    shape = _boxes_of(air)
    table = np.full(int(np.prod(shape)), -1, np.int32)
    inside = np.flatnonzero(airway_boxes(distance))
    table[inside] = np.arange(len(inside))
    bits = _find(air, bounds, inside, pool, progress)
    return VisibleSets(shape, table, bounds.numbers, bits)


def airway_boxes(distance: Volume) -> NDArray[np.bool_]:
    """Mark which boxes hold air with tissue on most sides, flat ``(boxes,)``."""
    tissue = distance.values > 0
    walls = np.zeros(tissue.shape, np.uint8)
    for axis in range(3):
        walls += np.logical_or.accumulate(tissue, axis=axis)
        back = np.logical_or.accumulate(np.flip(tissue, axis), axis=axis)
        walls += np.flip(back, axis)
    inside = ~tissue & (walls >= WALLED_SIDES)
    nz, ny, nx = (-(-(n - 1) // EDGE) for n in inside.shape)
    boxes = np.zeros((nz, ny, nx), bool)
    points = np.argwhere(inside)
    # the last points of a box's cells are the first of the next box's
    for shift in np.ndindex(2, 2, 2):
        k, j, i = np.clip((points - shift) // EDGE, 0, np.array(boxes.shape) - 1).T
        boxes[k, j, i] = True
    return boxes.reshape(-1)


def _boxes_of(air: AirCells) -> tuple[int, int, int]:
    nz, ny, nx = (-(-n // EDGE) for n in air.shape)
    return nz, ny, nx


def _find(
    air: AirCells,
    bounds: BlockBounds,
    boxes: NDArray[np.int64],
    pool: ThreadPool,
    progress: Progress | None,
) -> NDArray[np.uint8]:
    """Return the rows of bits of some boxes."""
    shape = _boxes_of(air)
    group = bounds.places >> GROUP_SHIFT
    order = np.lexsort(group.T)
    begins = np.ones(len(order), bool)
    begins[1:] = np.any(np.diff(group[order], axis=0) != 0, axis=1)
    first = np.append(np.flatnonzero(begins), len(order)).astype(np.int64)
    cells = np.ascontiguousarray(bounds.cells[order])
    if len(order) == 0:
        return np.zeros((len(boxes), 0), np.uint8)
    groups = np.concatenate(
        [
            np.minimum.reduceat(cells[:, :3], first[:-1]),
            np.maximum.reduceat(cells[:, 3:], first[:-1]),
        ],
        axis=1,
    )
    bits = np.zeros((len(boxes), -(-len(order) // 8)), np.uint8)
    free = [BoxFlood(air, EDGE) for _ in range(pool.threads)]

    def work(n: int) -> None:
        flood = free.pop()
        low = np.array(np.unravel_index(boxes[n], shape))[::-1] * EDGE
        met = np.empty(len(order), np.uint8)
        mark_met(flood.seen(low), groups, cells, first, met)
        free.append(flood)
        seen = np.empty(len(order), np.uint8)
        seen[order] = met
        bits[n] = np.packbits(seen, bitorder="little")
        if progress is not None:
            progress((n + 1) / len(boxes))

    pool.map(work, range(len(boxes)))
    return bits
