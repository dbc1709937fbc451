from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from benchmarks.simulated_ranks.host import Host, HostCosts
from benchmarks.simulated_ranks.replay import ReplayWork, Visits
from benchmarks.simulated_ranks.simulated_machine import SimulatedRank
from renderers.art.cells.cache import CellCache
from renderers.art.ranks.directory import Directory, homes, ring_distances
from renderers.art.ranks.messages import MessageKind
from renderers.art.ranks.node import Node

COSTS = HostCosts(
    message_s=10.0,
    own_s=4.0,
    bundle_s=6.0,
    byte_s=0.5,
    gather_s=0.0,
    poll_s=1.0,
    rest_s=0.5,
    switch_s=0.0,
    sleep_s=50.0,
    patience_s=100.0,
    latency_s=2.0,
    frame_s=20.0,
    packet_s=3.0,
    turn_s=1e9,
)
CELLS = 12


def make_ranks(
    rays: list[list[list[Visits]]], home: NDArray[np.int64]
) -> list[SimulatedRank]:
    """Make ranks with static homes and room for every cell."""
    ranks = len(rays)
    made: list[SimulatedRank] = []
    for rank, frames in enumerate(rays):
        cache = CellCache(CELLS)
        work = ReplayWork(cache, checks=False)
        place = Directory(rank, home, home, ring_distances(ranks))
        made.append((Node(work, place, cache, migrates=False), work, frames))
    return made


def some_rays(ranks: int, seed: int) -> list[list[list[Visits]]]:
    """Draw two frames of a few packets that meet a few cells."""
    random = np.random.default_rng(seed)
    return [
        [
            [
                Visits(random.permutation(CELLS)[:4].tolist(), [7.0] * 4)
                for _ in range(3)
            ]
            for _ in range(2)
        ]
        for _ in range(ranks)
    ]


def test_one_rank_needs_what_its_parts_cost() -> None:
    rays = [[[Visits([0, 1], [5.0, 6.0])]]]
    host = Host(COSTS, 1, make_ranks(rays, np.zeros(CELLS, int)), payload_bytes=8)
    # Two cells of its own are met one after another: each stops the packet once.
    moves = 3
    begun = COSTS.frame_s + COSTS.packet_s
    own = 2 * COSTS.own_s  # the pixels, and DONE
    assert host.run() == [pytest.approx(begun + 11.0 + moves * COSTS.poll_s + own)]
    assert host.moves == moves
    assert not host.sent


def test_a_cell_that_is_asked_for_takes_two_bundles() -> None:
    rays: list[list[list[Visits]]] = [[[]], [[Visits([0], [5.0])]]]
    home = np.zeros(CELLS, int)
    host = Host(COSTS, 2, make_ranks(rays, home), payload_bytes=8)
    host.run()
    assert host.sent[MessageKind.REQUEST] == host.sent[MessageKind.DATA] == 1
    first, second = host.ledgers
    assert first.directory == COSTS.message_s
    # The cell, and at last what rank 1 says to rank 0: pixels and DONE in one bundle.
    assert host.bundles == 3
    assert second.receive == COSTS.message_s + 8 * COSTS.byte_s + COSTS.bundle_s / 2
    assert second.send == 2 * COSTS.bundle_s / 2


@settings(max_examples=25, deadline=None)
@given(
    ranks=st.integers(1, 5),
    cores=st.integers(1, 5),
    seed=st.integers(0, 2**32 - 1),
    turn_s=st.sampled_from([5.0, 1e9]),
    patience_s=st.sampled_from([0.0, 100.0]),
)
def test_processors_give_no_more_time_than_they_have(
    ranks: int, cores: int, seed: int, turn_s: float, patience_s: float
) -> None:
    costs = replace(COSTS, turn_s=turn_s, patience_s=patience_s, switch_s=0.25)
    home = homes(CELLS, ranks)
    host = Host(costs, cores, make_ranks(some_rays(ranks, seed), home), payload_bytes=8)
    took = sum(host.run())
    used = [sum(ledger.parts().values()) for ledger in host.ledgers]
    most = min(cores, ranks) * took
    # A rank other than 0 may be at work when the frame ends, at most for one step.
    slack = ranks * 2 * (costs.message_s * CELLS + 2 * costs.bundle_s)
    assert sum(used) <= most + slack
    assert max(used) <= took + slack
    done = sum(ledger.render for ledger in host.ledgers)
    begun = 2 * ranks * (costs.frame_s + 3 * costs.packet_s)
    assert done == pytest.approx(begun + ranks * 2 * 3 * 4 * 7.0)
    assert host.sent[MessageKind.REQUEST] == host.sent[MessageKind.DATA]


@pytest.mark.parametrize("seed", range(5))
def test_work_that_says_nothing_is_shared_out_evenly(seed: int) -> None:
    random = np.random.default_rng(seed)
    seconds = random.integers(1, 50, 4) * 10.0
    rays = [[[Visits([0], [s])]] for s in seconds.tolist()]
    found = {}
    for cores in (1, 2, 4):
        # Every rank is home to the cell it meets.
        lots: list[SimulatedRank] = []
        for rank, frames in enumerate(rays):
            cache = CellCache(1)
            work = ReplayWork(cache, checks=False)
            home = np.full(CELLS, rank)
            place = Directory(rank, home, home, ring_distances(4))
            fresh = [[Visits(p.cells, p.seconds) for p in frames[0]]]
            lots.append((Node(work, place, cache, migrates=False), work, fresh))
        costs = replace(COSTS, frame_s=0.0, packet_s=0.0)
        (found[cores],) = Host(costs, cores, lots, payload_bytes=8).run()
    small = 200.0  # three bundles to rank 0, and looks
    assert seconds.sum() <= found[1] <= seconds.sum() + small
    assert seconds.max() <= found[4] <= seconds.max() + small
    assert max(seconds.sum() / 2, seconds.max()) <= found[2]
    assert found[2] <= seconds.sum() / 2 + seconds.max() + small


def test_a_host_has_processors() -> None:
    with pytest.raises(ValueError, match="at least 1 processor, got 0"):
        Host(COSTS, 0, [], payload_bytes=8)
