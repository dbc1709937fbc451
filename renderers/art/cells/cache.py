"""The cells a rank has at hand: what is known of each, and which goes next.

No values live here; `renderers.art.cells.bricks` keeps those by slot. A copy is PENDING
from the request until the cell comes, VALID, or ASKED while its home decides whether it
may go; an asked copy is used and served as before. The owner's copy is the one that
stays.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from enum import IntEnum

import numpy as np

from renderers.art.ranks.messages import ProtocolError

FRESH = np.iinfo(np.int64).max
"""Stamp of a cell that no ray has used yet. It may not be evicted: each fetch then
serves at least one ray, which is why the smallest cache still finishes."""


class CellState(IntEnum):
    """Name what a rank knows of a cell."""

    INVALID = 0
    PENDING = 1
    VALID = 2
    ASKED = 3


@dataclass(slots=True)
class _Copy:
    """One cell's place and flags.

    kept: its home said KEEP, and it has not been served since. deferred: ranks to send
    it to when it comes. version: the generation that changed it last.
    """

    slot: int
    state: CellState
    owned: bool = False
    kept: bool = False
    version: int = 0
    deferred: list[int] = field(default_factory=list)


class CellCache:
    """Follow up to `capacity` copies through their states.

    stamp: int64 ``(capacity + 1,)``, time of a slot's last use; whoever uses a cell
    writes it; the last is nobody's. quota: copies owned at most; the rest are slots to
    work with.
    """

    def __init__(self, capacity: int, quota: int = 0) -> None:
        """Make room for `capacity` cells, at least 1."""
        if capacity < 1:
            raise ValueError(f"a cache needs at least 1 cell, got {capacity}")
        if not 0 <= quota <= capacity:
            raise ValueError(f"of {capacity} cells a rank cannot own {quota}")
        self.capacity = capacity
        self.quota = quota
        # One more than there are: the place of what is empty, which never goes.
        self.stamp = np.zeros(capacity + 1, np.int64)
        self.pending = 0
        self.asked = 0
        self.owned = 0
        self.evictions = 0
        self.fetches = 0
        self.deferrals = 0
        self._copies: dict[int, _Copy] = {}
        self._free = list(range(capacity - 1, -1, -1))
        self._cell_of_slot = np.full(capacity + 1, -1, np.int64)
        # Slots that may not go: free, pending, asked, or kept.
        self._fixed = np.ones(capacity + 1, np.bool_)

    def grow(self, slots: int) -> None:
        """Make room for so many cells more; `stamp` is another array then."""
        before = self.capacity
        self.capacity += slots
        self.stamp = np.append(self.stamp, np.zeros(slots, np.int64))
        self._cell_of_slot = np.append(self._cell_of_slot, np.full(slots, -1))
        self._fixed = np.append(self._fixed, np.ones(slots, np.bool_))
        self._free[:0] = range(self.capacity - 1, before - 1, -1)

    def state(self, cell: int) -> CellState:
        """Tell what is known of a cell."""
        copy = self._copies.get(cell)
        return CellState.INVALID if copy is None else copy.state

    def holds(self, cell: int) -> bool:
        """Return whether rays can use a cell now."""
        copy = self._copies.get(cell)
        return copy is not None and copy.state >= CellState.VALID

    def owns(self, cell: int) -> bool:
        """Return whether this rank's copy is the one that stays."""
        copy = self._copies.get(cell)
        return copy is not None and copy.owned

    def slot(self, cell: int) -> int:
        """Return the place of a cell that is not INVALID."""
        return self._copies[cell].slot

    def place(self, cell: int) -> int | None:
        """Return the place of a cell that rays can use now; None for others."""
        copy = self._copies.get(cell)
        return copy.slot if copy is not None and copy.state >= 2 else None

    def version(self, cell: int) -> int:
        """Return the generation that changed a held cell last."""
        return self._copies[cell].version

    def cells(self) -> list[int]:
        """List the cells that are not INVALID."""
        return list(self._copies)

    def reserve(self, cell: int) -> bool:
        """Take a free slot for a cell, if there is one; it turns PENDING."""
        self._expect(cell, CellState.INVALID, "reserved")
        if not self._free:
            return False
        self._take(cell, CellState.PENDING)
        self.pending += 1
        return True

    def own(self, cell: int) -> None:
        """Begin with a cell as its owner."""
        self._expect(cell, CellState.INVALID, "dealt")
        if not self._free or self.owned >= self.quota:
            raise ValueError(f"no room to own cell {cell}: the quota is {self.quota}")
        copy = self._take(cell, CellState.VALID)
        copy.owned = True
        self.owned += 1
        self._fixed[copy.slot] = False
        self.stamp[copy.slot] = 0

    def store(self, cell: int, version: int = 0, *, fresh: bool = True) -> list[int]:
        """Turn a PENDING cell VALID; return the ranks that wait to be sent it.

        fresh: some ray waits for it, so that it may not go before that was here.
        """
        copy = self._expect(cell, CellState.PENDING, "stored")
        copy.state, copy.version = CellState.VALID, version
        self.stamp[copy.slot] = FRESH if fresh else 0
        self._fixed[copy.slot] = False
        self.pending -= 1
        self.fetches += 1
        deferred, copy.deferred = copy.deferred, []
        return deferred

    def fill(
        self, cells: Sequence[int], versions: Iterable[int], *, fresh: bool
    ) -> list[int]:
        """Turn cells VALID that are there at once; return their slots.

        As `reserve` and `store`. There must be room.
        """
        slots = [self._free.pop() for _ in cells]
        for cell, slot, version in zip(cells, slots, versions, strict=True):
            self._expect(cell, CellState.INVALID, "filled")
            self._copies[cell] = _Copy(slot, CellState.VALID, version=version)
        self._cell_of_slot[slots] = cells
        self.stamp[slots] = FRESH if fresh else 0
        self._fixed[slots] = False
        self.fetches += len(cells)
        return slots

    @property
    def free(self) -> int:
        """Count the free slots."""
        return len(self._free)

    def serve(self, cell: int, rank: int) -> bool:
        """Return whether a cell can be sent to a rank now; if not, it will be later."""
        copy = self._copies.get(cell)
        if copy is None:
            raise ProtocolError(f"cell {cell} is to be sent to {rank} while INVALID")
        if copy.state is CellState.PENDING:
            copy.deferred.append(rank)
            self.deferrals += 1
            return False
        if copy.kept:
            copy.kept = False
            self._fixed[copy.slot] = copy.state is not CellState.VALID
        return True

    def victim(self) -> int | None:
        """Pick the cell to go: the least recently used that may."""
        stamps = np.where(self._fixed, FRESH, self.stamp)
        slot = int(stamps.argmin())
        return None if stamps[slot] == FRESH else int(self._cell_of_slot[slot])

    def ask(self, cell: int) -> None:
        """Note that the home was asked whether a cell may go."""
        copy = self._expect(cell, CellState.VALID, "given up")
        copy.state = CellState.ASKED
        self._fixed[copy.slot] = True
        self.asked += 1

    def purge(self, cell: int) -> None:
        """Free the slot of a cell that its home lets go."""
        self._expect(cell, CellState.ASKED, "purged")
        self.asked -= 1
        self._release(cell)
        self.evictions += 1

    def keep(self, cell: int) -> None:
        """Keep a cell; it is not asked for again until it has been served."""
        copy = self._expect(cell, CellState.ASKED, "kept")
        copy.state, copy.kept = CellState.VALID, True
        self.asked -= 1

    def adopt(self, cell: int) -> bool:
        """Become a cell's owner unless the quota is full or the copy is about to go."""
        copy = self._copies.get(cell)
        if copy is None or copy.state is not CellState.VALID or copy.owned:
            return False
        if self.owned >= self.quota:
            return False
        copy.owned, copy.kept = True, False
        self._fixed[copy.slot] = False
        self.owned += 1
        return True

    def drop(self, cell: int) -> None:
        """Free the slot of a VALID cell whose home need not be asked."""
        self._expect(cell, CellState.VALID, "dropped")
        self._release(cell)

    def renew(self, cell: int, version: int) -> None:
        """Note that an owned cell was read anew."""
        copy = self._expect(cell, CellState.VALID, "renewed")
        copy.version, copy.kept = version, False
        self._fixed[copy.slot] = False
        self.stamp[copy.slot] = 0

    def no_ray_waits(self) -> None:
        """Let cells go that nobody will use: their rays were dropped."""
        self.stamp[self.stamp == FRESH] = 0

    def check(self) -> None:
        """Raise AssertionError when an invariant is broken."""
        copies = self._copies.values()
        assert len(self._free) + len(copies) == self.capacity
        assert len({copy.slot for copy in copies} | set(self._free)) == self.capacity
        assert self.pending == sum(c.state is CellState.PENDING for c in copies)
        assert self.asked == sum(c.state is CellState.ASKED for c in copies)
        assert self.owned == sum(c.owned for c in copies) <= max(self.quota, 0)
        for cell, copy in self._copies.items():
            assert self._cell_of_slot[copy.slot] == cell
            may_go = copy.state is CellState.VALID and not copy.kept
            assert self._fixed[copy.slot] != may_go
            assert not copy.deferred or copy.state is CellState.PENDING
        assert self._fixed[self._free].all()

    def _expect(self, cell: int, state: CellState, action: str) -> _Copy:
        copy = self._copies.get(cell)
        found = CellState.INVALID if copy is None else copy.state
        if found is not state:
            raise ProtocolError(
                f"cell {cell} was {action} while {found.name}, not {state.name}"
            )
        return copy if copy is not None else _NOWHERE

    def _take(self, cell: int, state: CellState) -> _Copy:
        slot = self._free.pop()
        copy = self._copies[cell] = _Copy(slot, state)
        self._cell_of_slot[slot] = cell
        self.stamp[slot] = FRESH
        return copy

    def _release(self, cell: int) -> None:
        copy = self._copies.pop(cell)
        self.owned -= copy.owned
        self._fixed[copy.slot] = True
        self._free.append(copy.slot)


_NOWHERE = _Copy(-1, CellState.INVALID)
