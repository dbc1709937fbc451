import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from renderers.art.ranks.rays import RayPacket, RayStack
from renderers.art.regions import Region


def packet(waiting: list[int]) -> RayPacket:
    n = len(waiting)
    made = RayPacket.start(
        Region(0, 0, n, 1), np.zeros((n, 8), np.float32), np.ones(n, np.int32)
    )
    made.cursor[:-1, 3] = np.array(waiting) + 1
    return made


def test_missing_cells_are_listed_once() -> None:
    assert packet([5, -1, 3, 5, 3]).missing_cells() == [3, 5]
    assert packet([-1, -1]).missing_cells() == []


@given(st.integers(0, 2**32 - 1))
def test_a_packet_wakes_once_by_any_of_its_cells(seed: int) -> None:
    rng = np.random.default_rng(seed)
    needs = [
        {int(c) for c in rng.integers(0, 7, rng.integers(1, 5))}
        for _ in range(rng.integers(1, 12))
    ]
    stack: RayStack[RayPacket] = RayStack()
    waiting = []
    for cells in needs:
        made = packet([0])
        stack.park(made, sorted(cells))
        waiting.append((made, cells))
    while waiting:
        stack.check()
        assert stack.waited_for() == set().union(*(cells for _, cells in waiting))
        assert len(stack) == len(waiting)
        cell = int(rng.integers(0, 7))
        woken = {id(made) for made, cells in waiting if cell in cells}
        assert stack.wake(cell) == len(woken) == stack.active
        assert {id(made) for made in stack.pop(100)} == woken
        waiting = [(m, c) for m, c in waiting if id(m) not in woken]
    assert not stack


def test_first_come_first_served() -> None:
    stack: RayStack[RayPacket] = RayStack()
    packets = [packet([-1]) for _ in range(5)]
    for made in packets:
        stack.push(made)
    assert stack.pop(2) == packets[:2]
    assert stack.pop(9) == packets[2:]


def test_nothing_cannot_be_waited_for() -> None:
    with pytest.raises(ValueError, match="wait for nothing"):
        RayStack[RayPacket]().park(packet([-1]), [])
