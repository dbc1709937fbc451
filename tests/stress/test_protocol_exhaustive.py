"""Small systems of ranks in every interleaving, whole and with rules taken away.

The graph of states must end nowhere but where all rays are finished and have no cycle,
which means that every schedule finishes. The second half takes one rule away at a time
and shows that the exploration finds out.
"""

from collections.abc import Callable
from typing import Any

import pytest

from renderers.art.cells.cache import CellCache, CellState
from renderers.art.ranks.directory import ON_DISK
from renderers.art.ranks.messages import MessageKind
from tests.slow_cases import slow
from tests.stress.exploration import Exploration, Rays, System


def two_ranks() -> System:
    """Each owns one cell and wants the other's, twice."""
    return System([0, 1], [1, 0], [(2, 1), (2, 1)], [[[0, 1]], [[1, 0, 1]]])


def three_ranks() -> System:
    """Two cells; the third rank owns nothing and has one slot."""
    rays: Rays = [[[1, 0]], [[0]], [[0, 1]]]
    return System([0, 1], [2, 0], [(2, 1), (2, 1), (1, 0)], rays)


def moving() -> System:
    """One slot to work with and another to adopt a cell: owners change."""
    rays: Rays = [[[1, 2]], [[0]], [[1]]]
    return System([0, 1, 2], [2, 0, 1], [(2, 1), (3, 2), (2, 1)], rays)


def edited() -> System:
    """Two frames; cell 0 changes between them."""
    rays: Rays = [[[1]], [[0]], [[0, 1]]]
    second: Rays = [[[0]], [[0]], [[1]]]
    return System([0, 1], [2, 0], [(2, 1)] * 3, rays, second)


def from_file() -> System:
    """No rank has to keep a cell; homes ask, too, and slots are few."""
    rays: Rays = [[[1, 0, 2]], [[0], [2]], [[1, 0]]]
    return System([ON_DISK] * 3, [1, 2, 0], [(1, 0), (1, 0), (2, 0)], rays)


def edited_file() -> System:
    """Two frames; cell 0 changes in the file between them."""
    rays: Rays = [[[0, 1]], [[0]], [[1]]]
    second: Rays = [[[0]], [[1, 0]], [[0]]]
    return System([ON_DISK] * 2, [2, 0], [(1, 0), (2, 0), (1, 0)], rays, second)


def tight() -> System:
    """Three cells, one slot to work with at each rank, two rays at one."""
    rays: Rays = [[[1, 2]], [[2], [0]], [[0, 1]]]
    return System([0, 1, 2], [1, 2, 0], [(2, 1)] * 3, rays)


def crowded() -> System:
    """Rays that come back to cells, two packets a rank, two cells to one owner."""
    rays: Rays = [[[2], [1]], [[0, 2], [2, 0]], [[1, 0]]]
    return System([0, 0, 1], [2, 2, 0], [(3, 2), (3, 2), (2, 1)], rays)


@pytest.mark.parametrize(
    "make",
    [
        two_ranks,
        three_ranks,
        moving,
        edited,
        from_file,
        edited_file,
        *slow(tight, crowded),
    ],
)
def test_every_schedule_finishes_and_breaks_nothing(make: Callable[[], System]) -> None:
    found = Exploration(make())
    assert found.failure == ""
    longest = found.longest()
    print(make.__name__, found.states, longest, sorted(found.kinds))
    assert longest is not None, "some schedule goes on for ever"
    assert found.states > 30
    if make is moving:
        assert MessageKind.ADOPTED in found.kinds


class Hasty(CellCache):
    """Ablation: a rank that still waits for a cell is told to pass it on, and tries."""

    def serve(self, cell: int, rank: int) -> bool:
        return True


class Careless(CellCache):
    """Ablation: a cell that came may go before any ray has used it."""

    def store(self, cell: int, version: int = 0, *, fresh: bool = True) -> list[int]:
        return super().store(cell, version, fresh=False)


class Impatient(CellCache):
    """Ablation: a rank does not remember that it has asked, and asks again."""

    def check(self) -> None:
        pass

    def reserve(self, cell: int) -> bool:
        self.asked = 0
        return super().reserve(cell)

    def ask(self, cell: int) -> None:
        self._expect(cell, CellState.VALID, "given up")
        self.asked += 1

    def purge(self, cell: int) -> None:
        self._expect(cell, CellState.VALID, "purged")
        self.asked = 0
        self._release(cell)

    def keep(self, cell: int) -> None:
        self.asked = 0


@pytest.mark.parametrize(
    ("make", "ablation", "failure"),
    [
        (three_ranks, {"cache": Hasty}, "is to be sent and is not here"),
        # without order between kinds the directory is wrong
        (three_ranks, {"fifo": False}, ""),
        (moving, {"fifo": False}, ""),
        # a wish is not answered
        (moving, {"answers": False}, "stuck"),
        # a rank that leaves when it is done takes its cells along
        (two_ranks, {"stays": False}, "stuck"),
        # nobody lists what changed
        (edited, {"tells": False}, "is held as generations {0, 1} left it"),
        (moving, {"cache": Impatient}, "would drop cell 0 twice"),
    ],
)
def test_a_rule_taken_away_is_missed(
    make: Callable[[], System], ablation: dict[str, Any], failure: str
) -> None:
    found = Exploration(System(**{**vars(make()), **ablation, "nodes": []})).failure
    assert found
    assert failure in found
    assert (found == "stuck") == (failure == "stuck")


def test_without_a_slot_to_work_with_all_are_stuck() -> None:
    found = Exploration(System([0, 1], [1, 0], [(1, 1)] * 2, [[[1]], [[0]]]))
    assert found.failure in ("stuck", "all slots are taken and no ray can go on")


def test_without_fresh_cells_some_schedule_goes_on_for_ever() -> None:
    def explore(cache: type[CellCache]) -> Exploration:
        rays: Rays = [[[1], [2]], []]
        owner, home, slots = [0, 1, 1], [1, 0, 1], [(2, 1), (3, 2)]
        return Exploration(System(owner, home, slots, rays, cache=cache))

    for cache, ends in ((CellCache, True), (Careless, False)):
        found = explore(cache)
        assert found.failure == ""
        assert (found.longest() is not None) == ends
