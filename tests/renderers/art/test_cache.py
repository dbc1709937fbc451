import math

import numpy as np
import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule

from renderers.art.cache import CellCache, CellState
from renderers.art.cells import CellGrid, cube_distances
from renderers.art.messages import ProtocolError

SHAPE = (17, 25, 18)
GRID = CellGrid(SHAPE)
VALUES = np.random.default_rng(0).normal(size=SHAPE).astype(np.float32)
NOWHERE = np.zeros((0, 2), np.float32)


def make_cache(capacity: int | None) -> CellCache:
    leap = cube_distances(VALUES, NOWHERE)
    everything = np.ones(GRID.cells, np.bool_)
    return CellCache(GRID, np.ones(3), everything, leap, capacity=capacity)


class CacheMachine(RuleBasedStateMachine):
    """Compare with a list: the oldest used cell that nobody waits for goes first."""

    CAPACITY = 4

    def __init__(self) -> None:
        super().__init__()
        self.cache = make_cache(self.CAPACITY)
        self.pending: set[int] = set()
        self.fresh: set[int] = set()
        self.used: list[int] = []
        self.clock = 0

    cells = st.integers(0, GRID.cells - 1)

    @property
    def held(self) -> set[int]:
        return self.pending | self.fresh | set(self.used)

    @rule(cell=cells)
    def reserve(self, cell: int) -> None:
        if cell in self.held:
            with pytest.raises(ProtocolError, match=f"cell {cell} was reserved"):
                self.cache.reserve(cell)
            return
        room = len(self.held) < self.CAPACITY
        assert self.cache.reserve(cell) == (room or bool(self.used))
        if not room and not self.used:
            return
        if not room:
            gone = self.used.pop(0)
            assert self.cache.state(gone) is CellState.INVALID
        self.pending.add(cell)

    @precondition(lambda self: self.pending)
    @rule()
    def store(self) -> None:
        cell = self.pending.pop()
        self.cache.store(cell, GRID.block(VALUES, cell))
        self.fresh.add(cell)

    @precondition(lambda self: self.fresh or self.used)
    @rule(data=st.data())
    def use(self, data: st.DataObject) -> None:
        cell = data.draw(st.sampled_from(sorted(self.fresh | set(self.used))))
        self.clock += 1
        self.cache.view.stamp[self.cache.view.slots[cell]] = self.clock
        self.fresh.discard(cell)
        if cell in self.used:
            self.used.remove(cell)
        self.used.append(cell)

    @invariant()
    def holds_what_it_should(self) -> None:
        self.cache.check()
        assert self.cache.pending == len(self.pending)
        for cell in range(GRID.cells):
            state = self.cache.state(cell)
            assert (state is CellState.PENDING) == (cell in self.pending)
            assert (state is not CellState.INVALID) == (cell in self.held)


TestCache = CacheMachine.TestCase
TestCache.settings = settings(max_examples=12, stateful_step_count=30, deadline=None)


def test_slots_are_made_as_they_are_needed() -> None:
    cache = make_cache(None)
    assert cache.capacity == cache.occupied == GRID.cells
    for cell in range(GRID.cells):
        assert cache.reserve(cell)
        cache.store(cell, GRID.block(VALUES, cell))
    cache.check()
    assert cache.evictions == 0
    side = GRID.side
    cubes = math.prod(n - 1 for n in SHAPE)
    assert cache.bytes == GRID.cells * (side + 1) ** 3 * 16 + cubes + 3


def test_dropping_rays_frees_what_they_waited_for() -> None:
    cache = make_cache(2)
    cache.reserve(0)
    cache.reserve(1)
    cache.store(1, GRID.block(VALUES, 1))
    assert not cache.reserve(2)
    cache.forget_waiting()
    cache.check()
    assert cache.state(0) is CellState.INVALID
    assert cache.reserve(2)
    assert cache.reserve(3)


def test_a_cell_cannot_come_unasked() -> None:
    with pytest.raises(ProtocolError, match="cell 3 was stored while INVALID"):
        make_cache(2).store(3, GRID.block(VALUES, 3))


def test_a_cache_has_room_for_something() -> None:
    with pytest.raises(ValueError, match="at least 1 cell"):
        make_cache(0)
