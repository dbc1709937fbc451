"""An orbit drawn by simulated ranks, set up as the paper's measurements were."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.simulated_ranks.audit import audit
from benchmarks.simulated_ranks.replay import ReplayWork, Visits
from benchmarks.simulated_ranks.simulated_machine import (
    Costs,
    Ledger,
    Machine,
)
from benchmarks.simulated_ranks.torus import Torus
from benchmarks.simulated_ranks.trace import FrameTrace, Orbit
from renderers.art.cells.cache import CellCache
from renderers.art.ranks.directory import Directory, deal_owners, homes
from renderers.art.ranks.messages import Message, MessageKind
from renderers.art.ranks.node import MOST_PENDING, Node
from renderers.art.ranks.policy import Dataflow
from renderers.art.ranks.prepare import MOST_WORKING
from renderers.art.regions import skew_of

PAPER_S = {
    128: {1: 2153, 2: 1062, 4: 557, 8: 281, 16: 142},
    256: {4: 3915, 8: 1968, 16: 996},
}
"""Table 1 of the paper: seconds for 30 frames, by voxels a side and by ranks."""


_STORY = 32
"""Messages a simulated rank remembers; thousands of ranks share this memory."""


@dataclass(frozen=True, slots=True)
class Setup:
    """Set one simulated run.

    cache: cells all ranks together can hold, in volumes. tile: pixels along a region of
    the screen; regions are dealt in skewed cyclic order.
    """

    ranks: int
    orbit: Orbit
    frames: int
    costs: Costs
    sample_s: float
    cache: float = 3.0
    tile: int = 32
    dataflow: Dataflow = Dataflow.MIGRATING
    most_pending: int = MOST_PENDING
    validate: bool = False


@dataclass(frozen=True, slots=True)
class Outcome:
    """What a simulated run found.

    seconds: of the whole; frame_s: by frame, from the last rank's end to the last
    rank's end. cells_fetched: by all ranks. slots: a rank's.
    """

    setup: Setup
    seconds: float
    frame_s: list[float]
    ledgers: list[Ledger]
    sent: dict[str, int]
    bytes_sent: int
    data_by_hops: dict[int, int]
    cells_fetched: int
    owners_moved: int
    slots: int

    def shares(self) -> dict[str, float]:
        """Return each part of the ledger as a share of all ranks' time."""
        whole = self.seconds * len(self.ledgers)
        total: dict[str, float] = {}
        for ledger in self.ledgers:
            for name, seconds in ledger.parts().items():
                total[name] = total.get(name, 0.0) + seconds / whole
        return total

    @property
    def overhead(self) -> float:
        """Return the share of send start-ups, messages and directory in the time."""
        shares = self.shares()
        return shares["send"] + shares["receive"] + shares["directory"]


class Traces:
    """Trace each frame of an orbit once, for all runs."""

    def __init__(self, orbit: Orbit) -> None:
        self.orbit = orbit
        self._frames: dict[int, FrameTrace] = {}

    def frame(self, number: int) -> FrameTrace:
        """Return a frame."""
        if number not in self._frames:
            self._frames[number] = self.orbit.frame(number)
        return self._frames[number]

    def samples(self, frames: int) -> int:
        """Count the samples of the first frames."""
        return sum(self.frame(k).samples for k in range(frames))

    def touch_share(self, frames: int, touch_s: float, sample_s: float) -> float:
        """Return the share of work's time that noting each use of a cell costs."""
        touches = sum(self.frame(k).crossings for k in range(frames))
        return touches * touch_s / (self.samples(frames) * sample_s)

    def deal(self, setup: Setup) -> list[list[list[Visits]]]:
        """Deal each rank its packets, by frame: tiles of the screen in cyclic order."""
        orbit, skew = self.orbit, skew_of(setup.ranks)
        wide = orbit.image // orbit.packet
        tile = max(setup.tile // orbit.packet, 1)
        dealt: list[list[list[Visits]]] = [[] for _ in range(setup.ranks)]
        for number in range(setup.frames):
            by_tile: dict[tuple[int, int], list[Visits]] = {}
            for packet, cells, samples in self.frame(number):
                row, column = divmod(packet, wide)
                lot = by_tile.setdefault((row // tile, column // tile), [])
                lot.append(Visits(cells, (samples * setup.sample_s).tolist()))
            for frames in dealt:
                frames.append([])
            for (ty, tx), lot in sorted(by_tile.items()):
                dealt[(tx + skew * ty) % setup.ranks][-1].extend(lot)
        return dealt


def payload_bytes(orbit: Orbit) -> int:
    """Return a cell's bytes on its way: one a voxel, with the ghosts of `CellGrid`."""
    return (orbit.cell + 3) ** 3


def simulate(setup: Setup, traces: Traces) -> Outcome:
    """Run the nodes that ship on a simulated machine."""
    orbit, costs = setup.orbit, setup.costs
    torus = Torus(setup.ranks, costs.link, costs.hop_s)
    watch: Callable[[Machine, Message], None] | None = None
    if setup.dataflow is Dataflow.REPLICATED:
        # No cell ever goes, and so nobody asks which was used last.
        setup = replace(setup, cache=float(setup.ranks))
        costs = replace(costs, touch_s=0.0)
    lots = list(_cell_lots(setup, traces, torus))
    nodes = [node for node, _, _ in lots]
    migrates = setup.dataflow is Dataflow.MIGRATING and setup.ranks > 1
    if setup.validate and migrates:

        def watch(machine: Machine, message: Message) -> None:
            audit(nodes, machine.flying(), (message.cell,))

    share = traces.touch_share(setup.frames, costs.touch_s, setup.sample_s)
    machine = Machine(
        costs,
        torus,
        lots,
        payload_bytes=payload_bytes(orbit),
        lru_share=share,
        watch=watch,
    )
    seconds = machine.run()
    if migrates:
        audit(nodes, machine.flying())
    ends = machine.frame_ends()
    return Outcome(
        setup,
        seconds,
        [b - a for a, b in zip([0.0, *ends], ends, strict=False)],
        machine.ledgers,
        {kind.name: machine.sent[kind] for kind in MessageKind if machine.sent[kind]},
        machine.bytes,
        dict(sorted(machine.data_by_hops.items())),
        sum(node.cache.fetches for node in nodes),
        sum(node.directory.moves for node in nodes),
        simulated_slots(setup)[0],
    )


def _cell_lots(
    setup: Setup, traces: Traces, torus: Torus
) -> Iterator[tuple[Node[Visits], ReplayWork, list[list[Visits]]]]:
    """Make ranks between which cells move, or which have them all."""
    orbit, ranks = setup.orbit, setup.ranks
    migrates = setup.dataflow is Dataflow.MIGRATING and ranks > 1
    alone = setup.dataflow is Dataflow.REPLICATED
    home = homes(orbit.cells, ranks)
    owner = deal_owners(np.ones(orbit.cells, np.bool_), ranks)
    slots, quota = simulated_slots(setup)
    for rank, frames in enumerate(traces.deal(setup)):
        cache = CellCache(slots, quota if migrates else 0)
        if migrates:
            for cell in np.flatnonzero(owner == rank).tolist():
                cache.own(cell)
        work = ReplayWork(cache, slice_s=setup.costs.slice_s, checks=migrates)
        place = Directory(
            rank, np.full(orbit.cells, rank) if alone else home, owner, torus.distances
        )
        node = Node(
            work,
            place,
            cache,
            migrates=migrates,
            most_pending=setup.most_pending,
            story=_STORY,
            validate=setup.validate,
        )
        yield node, work, frames


def simulated_slots(setup: Setup) -> tuple[int, int]:
    """Return a rank's slots and its quota of owned cells.

    Where homes are static a rank's share of the volume is set apart from its cache, so
    that every way has the same memory.
    """
    cells, ranks = setup.orbit.cells, setup.ranks
    share = -(-cells // ranks)
    slots = round(setup.cache * cells / ranks)
    if ranks == 1 or setup.dataflow is Dataflow.REPLICATED:
        return max(min(slots, cells), 1), 0
    if setup.dataflow is Dataflow.STATIC:
        return max(min(slots - share, cells), 1), 0
    slots = min(max(slots, share + 1), cells + 1)
    return slots, slots - min(MOST_WORKING, (slots - share + 1) // 2)


def paper_sample_s(traces: Traces, frames: int, side: int) -> float:
    """Return the one factor that makes one rank need what the paper's needed.

    128 voxels: one rank's time. 256: four ranks', at full efficiency; that table has
    no smaller number.
    """
    ranks, seconds = min(PAPER_S[side].items())
    return seconds * ranks * (frames / 30) / traces.samples(frames)
