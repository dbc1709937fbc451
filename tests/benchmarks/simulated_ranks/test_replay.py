import pytest

from benchmarks.simulated_ranks.replay import ReplayWork, Visits
from renderers.art.cells.cache import CellCache
from renderers.art.ranks.messages import ProtocolError


def make_work(slice_s: float = float("inf")) -> tuple[CellCache, ReplayWork]:
    cache = CellCache(4, 2)
    cache.own(0)
    cache.own(1)
    return cache, ReplayWork(cache, payload=b"cell", slice_s=slice_s)


def test_a_packet_stops_at_what_is_missing_and_goes_on_there() -> None:
    cache, work = make_work()
    packet = Visits([0, 2, 1], [1.0, 2.0, 4.0])
    assert work.run([packet], 5) == [[2]]
    assert (work.spent_s, work.visited) == (1.0, 1)
    assert cache.stamp[cache.slot(0)] == 5
    cache.reserve(2)
    assert work.run([packet], 6) == [[2]]
    cache.store(2)
    assert work.run([packet], 7) == [[]]
    assert (work.spent_s, work.tally()) == (7.0, {"cells_entered": 3})
    assert cache.stamp[cache.slot(1)] == 7


def test_a_packet_is_interrupted_when_its_slice_is_over() -> None:
    _, work = make_work(slice_s=2.5)
    packet = Visits([0, 1, 0, 1], [1.0] * 4)
    assert work.run([packet], 1) == [None]
    assert packet.done == 3
    assert work.run([packet], 2) == [[]]
    assert work.spent_s == 4.0


def test_only_what_is_here_can_be_sent() -> None:
    _, work = make_work()
    assert work.payload(0) == b"cell"
    with pytest.raises(ProtocolError, match="cell 3 is to be sent and is not here"):
        work.payload(3)
