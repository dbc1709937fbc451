from dataclasses import replace

import numpy as np
import pytest

from benchmarks.simulated_ranks.replay import ReplayWork, Visits
from benchmarks.simulated_ranks.simulated_machine import T3D, Costs, Machine
from benchmarks.simulated_ranks.torus import Torus
from renderers.art.cells.cache import CellCache
from renderers.art.ranks.directory import Directory
from renderers.art.ranks.messages import HEADER_BYTES
from renderers.art.ranks.node import Node

COSTS = Costs(
    send_s=1.0,
    receive_s=2.0,
    handle_s=4.0,
    copy_s=0.5,
    poll_s=0.0,
    scan_s=0.0,
    slice_s=float("inf"),
    link=HEADER_BYTES / 8.0,
    hop_s=0.25,
)
PAYLOAD = 4 * HEADER_BYTES


def make_machine(
    rays: list[list[list[Visits]]], home: list[int], costs: Costs = COSTS
) -> Machine:
    """Make ranks that each own the cell of their own number and have one slot more."""
    ranks = len(rays)
    torus = Torus(ranks, costs.link, costs.hop_s)
    made = []
    for rank, frames in enumerate(rays):
        cache = CellCache(3, 2)
        cache.own(rank)
        work = ReplayWork(cache)
        owner = np.arange(ranks)
        place = Directory(rank, np.array(home), owner, torus.distances)
        made.append((Node(work, place, cache, migrates=True), work, frames))
    return Machine(costs, torus, made, payload_bytes=PAYLOAD)


def test_a_cell_comes_when_its_three_hops_allow() -> None:
    machine = make_machine([[[Visits([1, 0], [100.0, 10.0])]], [[]], [[]]], [0, 2, 1])
    copy = PAYLOAD * COSTS.copy_s
    hop = COSTS.hop_s
    small, large = 8.0, 40.0
    request = COSTS.send_s + small + hop
    forward = 6.0 + COSTS.send_s + small + hop
    data = 6.0 + COSTS.send_s + copy + large + hop
    took = request + forward + data + 6.0 + copy + 110.0
    assert machine.run() == pytest.approx(took)
    first, second, home = machine.ledgers
    assert first.render == 110.0
    assert first.send == second.send - copy == home.send == COSTS.send_s
    assert (first.receive, second.receive) == (6.0 + copy, 6.0)
    assert (home.directory, home.receive) == (6.0, 0.0)
    assert dict(machine.data_by_hops) == {1: 1}


def test_what_is_sent_to_oneself_takes_no_network() -> None:
    machine = make_machine([[[Visits([1], [1.0])]], [[]]], [0, 0])
    machine.run()
    assert sum(machine.sent.values()) == 2
    assert machine.ledgers[0].directory == 6.0


@pytest.mark.parametrize("scan_s", [0.0, 1e-3])
def test_every_second_is_accounted_for(scan_s: float) -> None:
    rng = np.random.default_rng(3)
    costs = replace(T3D, scan_s=scan_s, slice_s=0.01)
    rays = [
        [
            [
                Visits(rng.permutation(4)[:3].tolist(), rng.random(3).tolist())
                for _ in range(4)
            ]
            for _ in range(3)
        ]
        for _ in range(4)
    ]
    work = sum(sum(p.seconds) for frames in rays for f in frames for p in f)
    machine = make_machine(rays, [2, 3, 0, 1], costs)
    took = machine.run()
    for ledger in machine.ledgers:
        assert sum(ledger.parts().values()) == pytest.approx(took, rel=1e-3)
    done = sum(ledger.render + ledger.lru for ledger in machine.ledgers)
    assert done == pytest.approx(work)
    assert machine.frame_ends()[-1] == took
    assert (sum(ledger.scan for ledger in machine.ledgers) > 0) == (scan_s > 0)
    assert not machine.flying()


def test_a_rank_without_rays_still_serves_and_ends() -> None:
    machine = make_machine([[[], [Visits([1], [2.0])], []], [[], [], []]], [1, 0])
    took = machine.run()
    assert took > 2.0
    assert len(machine.frame_ends()) == 3
