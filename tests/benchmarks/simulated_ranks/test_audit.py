import numpy as np
import pytest

from benchmarks.simulated_ranks.audit import audit
from benchmarks.simulated_ranks.replay import ReplayWork, Visits
from renderers.art.cells.cache import CellCache
from renderers.art.ranks.directory import Directory, ring_distances
from renderers.art.ranks.messages import Message, MessageKind
from renderers.art.ranks.node import Node

Ranks = list["Node[Visits]"]


@pytest.fixture
def ranks() -> Ranks:
    """Make three ranks, the first of which owns the only cell; the last is its home."""
    made = []
    for rank in range(3):
        cache = CellCache(2, 1)
        if rank == 0:
            cache.own(0)
        place = Directory(rank, np.array([2]), np.array([0]), ring_distances(3))
        made.append(Node(ReplayWork(cache), place, cache, migrates=True))
    return made


def fetch(ranks: Ranks, rank: int) -> None:
    ranks[rank].begin(1, [Visits([0])])
    (request,) = ranks[rank].advance(1)
    (forward,) = ranks[2].handle(request)
    (data,) = ranks[forward.target].handle(forward)
    ranks[rank].handle(data)
    ranks[rank].advance(1)


def test_each_step_of_a_request_is_in_order(ranks: Ranks) -> None:
    ranks[1].begin(1, [Visits([0])])
    (request,) = ranks[1].advance(1)
    audit(ranks, [request])
    (forward,) = ranks[2].handle(request)
    audit(ranks, [forward])
    (data,) = ranks[0].handle(forward)
    audit(ranks, [data])
    ranks[1].handle(data)
    audit(ranks, [])
    with pytest.raises(AssertionError, match="more cells are coming"):
        audit(ranks, [data] * 33)


def test_a_lost_owner_is_seen(ranks: Ranks) -> None:
    ranks[0].cache._copies[0].owned = False
    with pytest.raises(AssertionError, match="nobody owns cell 0"):
        audit(ranks, [])


def test_a_second_owner_is_seen(ranks: Ranks) -> None:
    fetch(ranks, 1)
    assert ranks[1].cache.adopt(0)
    with pytest.raises(AssertionError, match="owned by 1, too"):
        audit(ranks, [])
    accepted = Message(MessageKind.ADOPTED, 1, 2, 1, 0, aux=1)
    ranks[0].begin(1, [Visits([0])])
    audit(ranks, [accepted])


def test_a_copy_that_the_home_does_not_list_is_seen(ranks: Ranks) -> None:
    fetch(ranks, 1)
    audit(ranks, [])
    ranks[2].directory.entries[0].replicas.clear()
    with pytest.raises(
        AssertionError, match=r"cell 0 is at ranks \[.*1.*\], its home lists"
    ):
        audit(ranks, [])


def test_a_stale_copy_is_seen(ranks: Ranks) -> None:
    fetch(ranks, 1)
    ranks[0].cache.renew(0, 4)
    with pytest.raises(AssertionError, match="held as generations"):
        audit(ranks, [])


def test_a_message_when_all_are_done_is_seen(ranks: Ranks) -> None:
    with pytest.raises(AssertionError, match="all ranks are done"):
        audit(ranks, [Message(MessageKind.FORWARD, 2, 0, 1, 0, who=1)])
