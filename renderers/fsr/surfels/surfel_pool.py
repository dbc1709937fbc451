"""Surfels block by block, in memory where single blocks can be replaced."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderers.fsr.kernels.extract_surfels import move_runs
from renderers.fsr.surfels.surfel_set import Surfels

SPARE_ROWS = 16
"""Rows after the last: vectors load sixteen at a time."""

SLOT = 16
"""A slot holds a multiple of so many surfels, so that it fits other blocks later."""

LEAST_SPARE = 4096
"""Surfels that a pool has room for beyond those that it begins with, at least."""


class BlockSpans(NamedTuple):
    """Where each block's elements are.

    begins, ends: ``(blocks,)`` int64. rows: ``(blocks,)`` int64, how many rows of the
    grid they are in.
    """

    begins: NDArray[np.int64]
    ends: NDArray[np.int64]
    rows: NDArray[np.int64]

    @property
    def total(self) -> int:
        """Return the number of elements in all blocks."""
        return int((self.ends - self.begins).sum())


class SurfelPool:
    """Surfels block by block, in grid order within a block.

    A block has a slot anywhere in the pool. One that outgrows it moves to another, and
    what it leaves is taken by blocks that fit. A pool without room is written anew,
    without gaps: it never has room for more than an eighth beyond what it holds, and
    `LEAST_SPARE`.

    position, normal: ``(n + 16, 3)`` float32 as in `Surfels`. spans: where the blocks'
    surfels are. first_mm: world position of the grid's first point, from which
    positions are counted. spacing_mm: as in `Surfels`. far: as in `Surfels`. shift: a
    block has ``2**shift`` of the set's elements a side. refine: elements per voxel and
    axis.
    """

    def __init__(
        self,
        surfels: Surfels,
        index: NDArray[np.int64],
        spans: BlockSpans,
        shift: int,
        refine: int,
    ) -> None:
        """Sort surfels; index: their order, in which the blocks have these spans."""
        self.shift = shift
        self.refine = refine
        self.first_mm = surfels.rows.world_from_voxel[:3, 3]
        self.spacing_mm = surfels.spacing_mm
        self.far = surfels.far
        self.spans = spans
        self._room = spans.ends - spans.begins
        self._free: dict[int, list[int]] = {}
        self._used = len(index)
        self.position, self.normal = _make_rows(_with_spare(self._used))
        self.position[: self._used] = surfels.position[index]
        self.normal[: self._used] = surfels.normal[index]
        self._count = self._used

    def __len__(self) -> int:
        return self._count

    @property
    def size(self) -> int:
        """Return the number of surfels that there is room for."""
        return len(self.position) - SPARE_ROWS

    def rearrange(self, source: NDArray[np.int64]) -> None:
        """Follow a new list of blocks; source: each one's old place, or -1."""
        stays = np.zeros(len(self._room), np.bool_)
        stays[source[source >= 0]] = True
        for at in np.flatnonzero(~stays).tolist():
            self._count -= int(self.spans.ends[at] - self.spans.begins[at])
            self._release(at)
        self.spans = BlockSpans(*(_rearranged(column, source) for column in self.spans))
        self._room = _rearranged(self._room, source)

    def replace(
        self,
        blocks: NDArray[np.int64],
        counts: NDArray[np.int64],
        rows: NDArray[np.int64],
        position: NDArray[np.float32],
        normal: NDArray[np.float32],
    ) -> None:
        """Give blocks other surfels, `counts` of them each, one block after the other.

        rows: how many rows of the grid each block's surfels are in.
        """
        held = self.spans.ends[blocks] - self.spans.begins[blocks]
        self._count += int(counts.sum() - held.sum())
        self.spans.ends[blocks] = self.spans.begins[blocks]
        slots = -(-(counts + counts // SLOT) // SLOT) * SLOT
        if self._used + slots[counts > self._room[blocks]].sum() > self.size:
            self._write_anew(int(slots.sum()))
        for n in np.flatnonzero(counts > self._room[blocks]).tolist():
            at, room = int(blocks[n]), int(slots[n])
            self._release(at)
            self.spans.begins[at] = self._take(room)
            self._room[at] = room
        begins = self.spans.begins[blocks]
        self.spans.ends[blocks] = begins + counts
        self.spans.rows[blocks] = rows
        first = np.cumsum(counts) - counts
        move_runs(position, normal, first, counts, self.position, self.normal, begins)

    def _take(self, room: int) -> int:
        """Return where a free slot of so many surfels begins."""
        if free := self._free.get(room):
            return free.pop()
        begin = self._used
        self._used += room
        return begin

    def _release(self, at: int) -> None:
        """Leave a block's slot to others."""
        if room := int(self._room[at]) // SLOT * SLOT:
            self._free.setdefault(room, []).append(int(self.spans.begins[at]))
        self._room[at] = 0

    def _write_anew(self, more: int) -> None:
        """Copy all that is held, without gaps, to where there is room for `more`."""
        counts = self.spans.ends - self.spans.begins
        begins = np.cumsum(counts) - counts
        position, normal = _make_rows(_with_spare(self._count + more))
        move_runs(
            self.position,
            self.normal,
            self.spans.begins,
            counts,
            position,
            normal,
            begins,
        )
        self.position, self.normal = position, normal
        self.spans = BlockSpans(begins, begins + counts, self.spans.rows)
        self._room = counts
        self._used = int(counts.sum())
        self._free = {}


def _rearranged(
    column: NDArray[np.int64], source: NDArray[np.int64]
) -> NDArray[np.int64]:
    """Take values from other places; 0 where the place is -1."""
    is_new = source < 0
    if is_new.all():
        return np.zeros(len(source), np.int64)
    taken = column[source]
    taken[is_new] = 0
    return taken


def _with_spare(count: int) -> int:
    return count + max(count // 8, LEAST_SPARE)


def _make_rows(count: int) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    # pages of which nothing is used cost nothing
    position = np.empty((count + SPARE_ROWS, 3), np.float32)
    normal = np.empty((count + SPARE_ROWS, 3), np.float32)
    position[count:] = normal[count:] = 1
    return position, normal
