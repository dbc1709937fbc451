"""The cells a rank has at hand: invalid, pending or valid; least recently used goes."""

from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderers.art.cells import CellGrid
from renderers.art.messages import ProtocolError
from renderers.art.preparation import build_brick
from renderers.art.views import CellView

_FRESH = np.iinfo(np.int64).max
"""Stamp of a cell that no ray has used yet. It may not be evicted: each fetch then
serves at least one ray, which is why the smallest cache still finishes."""

_FIRST_SLOTS = 64


class CellState(IntEnum):
    """Name what a rank knows of a cell."""

    INVALID = 0
    PENDING = 1
    VALID = 2


class CellCache:
    """Hold up to `capacity` cells as bricks the kernels can read.

    Slots are allocated as they are first needed. A cell is reserved (INVALID to
    PENDING) before it is stored (PENDING to VALID); a reservation may push out the
    least recently used valid cell.
    """

    def __init__(
        self,
        grid: CellGrid,
        spacing_mm: NDArray[np.float64],
        occupied: NDArray[np.bool_],
        leap: NDArray[np.uint8],
        *,
        capacity: int | None = None,
    ) -> None:
        """Take which cells are to be seen, and the distances of `cube_distances`.

        capacity: slots, at least 1; None for as many as there are cells to be seen.
        """
        if capacity is not None and capacity < 1:
            raise ValueError(f"a cache needs at least 1 cell, got {capacity}")
        self.grid = grid
        self._inverse_spacing = (1 / np.asarray(spacing_mm)).astype(np.float32)
        self._size = np.array(grid.shape[::-1], np.int32)
        self.occupied = int(np.count_nonzero(occupied))
        self.capacity = min(capacity or self.occupied, max(self.occupied, 1))
        self._state = np.zeros(grid.cells, np.uint8)
        self._free: list[int] = []
        self._cell_of_slot = np.zeros(0, np.int64)
        self._slot_of_cell: dict[int, int] = {}
        self._pending = 0
        self.evictions = 0
        self.fetches = 0
        self.view = CellView(
            top=self._size - 2,
            counts=np.array(grid.counts[::-1], np.int32),
            leap=leap,
            slots=np.full(grid.cells, -1, np.int32),
            samples=np.zeros(0, np.float32),
            stamp=np.zeros(0, np.int64),
        )
        self._grow(min(self.capacity, _FIRST_SLOTS))

    def state(self, cell: int) -> CellState:
        """Tell what is known of a cell."""
        return CellState(self._state[cell])

    @property
    def pending(self) -> int:
        """Count the reserved cells that have not arrived."""
        return self._pending

    @property
    def bytes(self) -> int:
        """Get the memory of all slots and of the distances."""
        return self.view.samples.nbytes + self.view.leap.nbytes

    def reserve(self, cell: int) -> bool:
        """Make room for a cell; tell whether there was any. The cell turns PENDING."""
        self._expect(cell, CellState.INVALID, "reserved")
        if not self._free and len(self._cell_of_slot) < self.capacity:
            self._grow(min(self.capacity, 2 * len(self._cell_of_slot)))
        if not self._free and not self._evict():
            return False
        slot = self._free.pop()
        self._slot_of_cell[cell] = slot
        self._cell_of_slot[slot] = cell
        self._state[cell] = CellState.PENDING
        self._pending += 1
        self.view.stamp[slot] = _FRESH
        return True

    def store(self, cell: int, block: NDArray[Any]) -> None:
        """Fill a reserved cell from its block of raw values; it turns VALID."""
        self._expect(cell, CellState.PENDING, "stored")
        slot = self._slot_of_cell[cell]
        n = (self.grid.side + 1) ** 3 * 4
        build_brick(
            np.array(block, dtype=np.float32, order="C"),
            np.array(self.grid.start(cell)[::-1], np.int32),
            self._size,
            self._inverse_spacing,
            self.view.samples[slot * n : (slot + 1) * n],
        )
        self._state[cell] = CellState.VALID
        self._pending -= 1
        self.view.slots[cell] = slot
        self.fetches += 1

    def forget_waiting(self) -> None:
        """Let cells go that nobody will use: their rays were dropped."""
        for cell in np.flatnonzero(self._state == CellState.PENDING):
            self._release(int(cell))
        self._pending = 0
        self.view.stamp[self.view.stamp == _FRESH] = 0

    def check(self) -> None:
        """Raise AssertionError when an invariant is broken."""
        held = np.flatnonzero(self._state)
        assert len(held) == len(self._slot_of_cell) <= self.capacity
        assert len(self._free) + len(held) == len(self._cell_of_slot) <= self.capacity
        assert self._pending == np.count_nonzero(self._state == CellState.PENDING)
        for cell in held:
            slot = self._slot_of_cell[int(cell)]
            assert self._cell_of_slot[slot] == cell
            valid = self._state[cell] == CellState.VALID
            assert self.view.slots[cell] == (slot if valid else -1)
        assert np.count_nonzero(self.view.slots >= 0) == np.count_nonzero(
            self._state == CellState.VALID
        )

    def _expect(self, cell: int, state: CellState, action: str) -> None:
        found = self.state(cell)
        if found != state:
            raise ProtocolError(
                f"cell {cell} was {action} while {found.name}, not {state.name}"
            )

    def _evict(self) -> bool:
        # Only called without a free slot, so every stamp belongs to a held cell.
        oldest = int(np.argmin(self.view.stamp))
        if self.view.stamp[oldest] == _FRESH:
            return False
        self._release(int(self._cell_of_slot[oldest]))
        self.evictions += 1
        return True

    def _release(self, cell: int) -> None:
        self._free.append(self._slot_of_cell.pop(cell))
        self._state[cell] = CellState.INVALID
        self.view.slots[cell] = -1

    def _grow(self, slots: int) -> None:
        before = len(self._cell_of_slot)
        added = slots - before
        n = (self.grid.side + 1) ** 3 * 4
        v = self.view
        self._cell_of_slot = np.append(self._cell_of_slot, np.zeros(added, np.int64))
        self.view = v._replace(
            samples=np.append(v.samples, np.zeros(added * n, np.float32)),
            stamp=np.append(v.stamp, np.zeros(added, np.int64)),
        )
        self._free.extend(range(slots - 1, before - 1, -1))
