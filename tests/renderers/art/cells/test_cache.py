import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule

from renderers.art.cells.cache import CellCache, CellState
from renderers.art.ranks.messages import ProtocolError

CELLS = 18


class CacheMachine(RuleBasedStateMachine):
    """Compare with lists: the oldest used cell that may go is the one to go."""

    CAPACITY, QUOTA = 6, 3

    def __init__(self) -> None:
        super().__init__()
        self.cache = CellCache(self.CAPACITY, self.QUOTA)
        self.pending: dict[int, list[int]] = {}
        self.fresh: set[int] = set()
        self.used: list[int] = []
        self.asked: dict[int, bool] = {}
        self.kept: set[int] = set()
        self.owned: set[int] = set()
        self.clock = 0

    cells = st.integers(0, CELLS - 1)

    @property
    def here(self) -> set[int]:
        return self.fresh | set(self.used) | self.asked.keys()

    @property
    def held(self) -> set[int]:
        return self.pending.keys() | self.here

    def any_of(self, data: st.DataObject, cells: set[int]) -> int:
        return data.draw(st.sampled_from(sorted(cells)))

    @rule(cell=cells)
    def reserve(self, cell: int) -> None:
        if cell in self.held:
            with pytest.raises(ProtocolError, match=f"cell {cell} was reserved"):
                self.cache.reserve(cell)
            return
        room = len(self.held) < self.CAPACITY
        assert self.cache.reserve(cell) == room
        if room:
            self.pending[cell] = []

    @precondition(lambda self: self.pending)
    @rule(data=st.data())
    def store(self, data: st.DataObject) -> None:
        cell = self.any_of(data, set(self.pending))
        assert self.cache.store(cell) == self.pending.pop(cell)
        self.fresh.add(cell)

    @precondition(lambda self: self.here)
    @rule(data=st.data())
    def use(self, data: st.DataObject) -> None:
        cell = self.any_of(data, self.here)
        self.clock += 1
        self.cache.stamp[self.cache.slot(cell)] = self.clock
        self.fresh.discard(cell)
        if cell in self.used:
            self.used.remove(cell)
        if cell not in self.asked:
            self.used.append(cell)

    @rule(cell=cells, rank=st.integers(0, 9))
    def serve(self, cell: int, rank: int) -> None:
        if cell not in self.held:
            with pytest.raises(ProtocolError, match=f"sent to {rank} while INVALID"):
                self.cache.serve(cell, rank)
            return
        assert self.cache.serve(cell, rank) == (cell in self.here)
        self.kept.discard(cell)
        if cell in self.pending:
            self.pending[cell].append(rank)

    @rule()
    def give_up(self) -> None:
        may_go = [cell for cell in self.used if cell not in self.kept]
        victim = self.cache.victim()
        assert victim == (may_go[0] if may_go else None)
        if victim is not None:
            self.cache.ask(victim)
            self.used.remove(victim)
            self.asked[victim] = True

    @precondition(lambda self: self.asked)
    @rule(data=st.data(), goes=st.booleans())
    def answer(self, data: st.DataObject, goes: bool) -> None:
        cell = self.any_of(data, set(self.asked))
        del self.asked[cell]
        if goes:
            self.cache.purge(cell)
            self.owned.discard(cell)
        else:
            self.cache.keep(cell)
            self.kept.add(cell)
            self.used.append(cell)
            self.clock += 1
            self.cache.stamp[self.cache.slot(cell)] = self.clock

    @rule(cell=cells)
    def adopt(self, cell: int) -> None:
        can = cell in self.fresh or cell in self.used
        can = can and cell not in self.owned and len(self.owned) < self.QUOTA
        assert self.cache.adopt(cell) == can
        if can:
            self.owned.add(cell)
            self.kept.discard(cell)

    @invariant()
    def holds_what_it_should(self) -> None:
        self.cache.check()
        assert self.cache.pending == len(self.pending)
        assert self.cache.asked == len(self.asked)
        assert self.cache.owned == len(self.owned)
        for cell in range(CELLS):
            state = self.cache.state(cell)
            assert (state is CellState.PENDING) == (cell in self.pending)
            assert (state is CellState.ASKED) == (cell in self.asked)
            assert (state is not CellState.INVALID) == (cell in self.held)
            assert self.cache.holds(cell) == (cell in self.here)
            assert self.cache.owns(cell) == (cell in self.owned)


TestCache = CacheMachine.TestCase
TestCache.settings = settings(max_examples=40, stateful_step_count=50, deadline=None)


def test_owned_cells_leave_slots_to_work_with() -> None:
    cache = CellCache(3, 2)
    cache.own(0)
    cache.own(1)
    with pytest.raises(ValueError, match="no room to own cell 2: the quota is 2"):
        cache.own(2)
    assert cache.reserve(2)
    assert not cache.reserve(3)
    cache.check()


def test_dropping_rays_lets_cells_go_that_nobody_used() -> None:
    cache = CellCache(1)
    cache.reserve(0)
    cache.store(0)
    assert cache.victim() is None
    cache.no_ray_waits()
    assert cache.victim() == 0


def test_an_edited_cell_may_go_again() -> None:
    cache = CellCache(2, 1)
    cache.own(0)
    cache.ask(0)
    cache.keep(0)
    assert cache.victim() is None
    cache.renew(0, 7)
    assert cache.version(0) == 7
    assert cache.victim() == 0
    cache.check()


def test_a_cell_cannot_come_unasked() -> None:
    with pytest.raises(ProtocolError, match="cell 3 was stored while INVALID"):
        CellCache(2).store(3)


def test_a_cache_has_room_for_something() -> None:
    with pytest.raises(ValueError, match="at least 1 cell"):
        CellCache(0)
    with pytest.raises(ValueError, match="of 2 cells a rank cannot own 3"):
        CellCache(2, 3)
