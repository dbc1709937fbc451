"""Larger systems of ranks under random schedules, checked after every step."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, rule

from benchmarks.simulated_ranks.audit import audit
from benchmarks.simulated_ranks.replay import ReplayWork, Visits
from renderers.art.cells.cache import CellCache
from renderers.art.ranks.directory import (
    ON_DISK,
    Directory,
    deal_owners,
    homes,
    ring_distances,
)
from renderers.art.ranks.messages import Message, MessageKind
from renderers.art.ranks.node import Node
from renderers.art.ranks.prepare import slots_of
from tests.loop_back import LoopBack
from tests.slow_cases import slow

Ranks = list["Node[Visits]"]


def make_ranks(
    ranks: int, cells: int, spare: int, pending: int, from_file: bool = False
) -> Ranks:
    """Make nodes whose caches have `spare` slots beyond their share.

    from_file: nobody has a share; homes can read every cell.
    """
    home = homes(cells, ranks)
    owner = deal_owners(np.ones(cells, np.bool_), ranks)
    slots = slots_of(cells, ranks, -(-cells // ranks) + spare)
    if from_file:
        owner, slots = np.full(cells, ON_DISK), (spare, 0)
    made = []
    for rank in range(ranks):
        cache = CellCache(*slots)
        for cell in np.flatnonzero(owner == rank).tolist():
            cache.own(cell)
        place = Directory(rank, home, owner, ring_distances(ranks))
        node = Node(
            ReplayWork(cache),
            place,
            cache,
            migrates=True,
            most_pending=pending,
            validate=True,
        )
        made.append(node)
    return made


class Protocol(RuleBasedStateMachine):
    """Let chance choose who moves and what arrives; look at everything after each."""

    @initialize(
        ranks=st.integers(4, 16),
        side=st.integers(3, 5),
        spare=st.integers(1, 4),
        pending=st.sampled_from([1, 2, 8]),
        seed=st.integers(0, 2**32 - 1),
        from_file=st.booleans(),
    )
    def begin(
        self,
        ranks: int,
        side: int,
        spare: int,
        pending: int,
        seed: int,
        from_file: bool,
    ) -> None:
        self.cells = side**3
        self.random = np.random.default_rng(seed)
        self.joint = LoopBack(ranks, seed, delay=0.0)
        self.nodes = make_ranks(ranks, self.cells, spare, pending, from_file)
        self.frame = self.generation = 0
        self.touched: set[int] | None = None
        self.next_frame()

    def next_frame(self) -> None:
        self.frame += 1
        for node in self.nodes:
            node.begin(self.frame, [self.packet() for _ in range(3)])

    def packet(self) -> Visits:
        """Walk from cell to cell; sometimes come back."""
        start = int(self.random.integers(self.cells))
        steps = self.random.integers(-2, 3, self.random.integers(1, 9))
        return Visits(((start + np.cumsum(steps)) % self.cells).tolist())

    def send(self, messages: list[Message]) -> None:
        for message in messages:
            if message.kind is not MessageKind.REGION:
                self.joint.put(message)

    def turn(self, rank: int) -> None:
        node = self.nodes[rank]
        self.send(node.advance(1))
        message = self.joint.take(rank)
        if message is not None:
            self.touched = {message.cell}
            self.send(node.handle(message))

    @rule(turns=st.lists(st.integers(0, 15), min_size=1, max_size=30))
    def some_turns(self, turns: list[int]) -> None:
        for rank in turns:
            self.turn(rank % len(self.nodes))
            audit(self.nodes, self.joint.flying(), self.touched or ())

    @rule()
    def cancel(self) -> None:
        for node in self.nodes:
            node.cancel()
        self.finish()

    @rule()
    def finish(self) -> None:
        for _ in range(400 * self.cells):
            if all(node.is_finished for node in self.nodes):
                break
            self.turn(int(self.random.integers(len(self.nodes))))
        assert all(node.is_finished for node in self.nodes), "rays do not finish"
        assert self.joint.in_flight == 0
        self.next_frame()

    @rule(data=st.data())
    def edit(self, data: st.DataObject) -> None:
        self.finish()
        for node in self.nodes:
            node.cancel()
        changed = data.draw(st.sets(st.integers(0, self.cells - 1), max_size=5))
        self.generation += 1
        for node in self.nodes:
            node.edit(self.generation, sorted(changed))
        self.next_frame()

    @invariant()
    def all_is_well(self) -> None:
        audit(self.nodes, self.joint.flying())


TestProtocol = Protocol.TestCase
TestProtocol.settings = settings(max_examples=4, stateful_step_count=6, deadline=None)


def run_to_the_end(
    ranks: int, side: int, spare: int, seed: int, delay: float, from_file: bool = False
) -> Ranks:
    """Draw one frame of straight walks."""
    random = np.random.default_rng(seed)
    joint = LoopBack(ranks, seed, delay)
    cells = side**3
    nodes = make_ranks(ranks, cells, spare, 4, from_file)
    grid = np.arange(cells).reshape((side,) * 3)
    for node in nodes:
        walks = [np.moveaxis(grid, random.integers(3), 0) for _ in range(6)]
        at = random.integers(0, side, (6, 2))
        node.begin(
            1,
            [Visits(w[:, j, k].tolist()) for w, (j, k) in zip(walks, at, strict=True)],
        )
    steps = 0
    while not all(node.is_finished for node in nodes):
        node = nodes[int(random.integers(ranks))]
        sent = node.advance(1)
        message = joint.take(node.rank)
        if message is not None:
            sent += node.handle(message)
        for answer in sent:
            if answer.kind is not MessageKind.REGION:
                joint.put(answer)
        steps += 1
        if message is not None:
            audit(nodes, joint.flying(), {message.cell})
        assert steps < 3000 * ranks * side, "rays do not finish"
    audit(nodes, joint.flying())
    assert joint.in_flight == 0
    return nodes


@pytest.mark.parametrize("ranks", [4, *slow(7, 8, 16)])
@pytest.mark.parametrize("side", [3, 4, *slow(5, 8)])
@settings(max_examples=2, deadline=None)
@given(
    spare=st.integers(1, 9),
    seed=st.integers(0, 2**32 - 1),
    delay=st.sampled_from([0.0, 0.5, 0.95]),
    from_file=st.booleans(),
)
def test_rays_finish_with_the_smallest_caches(
    ranks: int, side: int, spare: int, seed: int, delay: float, from_file: bool
) -> None:
    nodes = run_to_the_end(ranks, side, spare, seed, delay, from_file)
    visits = sum(node.work.tally()["cells_entered"] for node in nodes)
    fetches = sum(node.cache.fetches for node in nodes)
    assert visits == ranks * 6 * side
    # A cell that was fetched is used before it goes.
    assert fetches <= visits


def test_with_room_for_it_cells_get_new_owners() -> None:
    moved = sum(
        node.directory.moves
        for seed in range(4)
        for node in run_to_the_end(5, 4, 8, seed, 0.3)
    )
    assert moved > 0
