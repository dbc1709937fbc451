"""An orbit drawn by simulated ranks, set up as the paper's measurements were."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from benchmarks.simulated_ranks.audit import audit
from benchmarks.simulated_ranks.replay import ReplayWork, Visits
from benchmarks.simulated_ranks.simulated_machine import (
    Costs,
    Ledger,
    Machine,
    SimulatedRank,
)
from benchmarks.simulated_ranks.torus import Torus
from benchmarks.simulated_ranks.trace import FrameTrace, Orbit
from benchmarks.simulated_ranks.trips import (
    Begun,
    Strand,
    StrandPacket,
    StrandRayNode,
    StrandTravel,
)
from renderers.art.cells.cache import CellCache
from renderers.art.ranks.directory import Directory, deal_owners, homes
from renderers.art.ranks.messages import Message, MessageKind
from renderers.art.ranks.node import MOST_PENDING, Node
from renderers.art.ranks.policy import Dataflow
from renderers.art.ranks.prepare import MOST_WORKING
from renderers.art.regions import skew_of

T = TypeVar("T")

PAPER_S = {
    128: {1: 2153, 2: 1062, 4: 557, 8: 281, 16: 142},
    256: {4: 3915, 8: 1968, 16: 996},
}
"""Table 1 of the paper: seconds for 30 frames, by voxels a side and by ranks."""


_STORY = 32
"""Messages a simulated rank remembers; thousands of ranks share this memory."""


def morton_number(column: int, row: int) -> int:
    """Return a square's number on the Morton curve: near there is near on screen."""
    key = 0
    for bit in range(max(column, row).bit_length()):
        key |= (column >> bit & 1) << 2 * bit | (row >> bit & 1) << 2 * bit + 1
    return key


@dataclass(frozen=True, slots=True)
class Setup:
    """Set one simulated run.

    cache: cells all ranks together can hold, in volumes. tile: pixels along a region of
    the screen. by_curve: each rank has one run of packets along a Morton curve, all
    runs with equal work; else regions in skewed cyclic order.
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
    by_curve: bool = False
    validate: bool = False


@dataclass(frozen=True, slots=True)
class Outcome:
    """Say what a simulated run found.

    seconds: of the whole; frame_s: by frame, from the last rank's end to the last
    rank's end. cells_fetched, rays_sent: by all ranks. slots: a rank's.
    """

    setup: Setup
    seconds: float
    frame_s: list[float]
    ledgers: list[Ledger]
    sent: dict[str, int]
    bytes_sent: int
    data_by_hops: dict[int, int]
    cells_fetched: int
    rays_sent: int
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

    def deal_strands(self, setup: Setup) -> list[list[list[StrandPacket]]]:
        """Deal each rank its packets as strands, by frame."""
        dealt: list[list[list[StrandPacket]]] = [[] for _ in range(setup.ranks)]
        for number in range(setup.frames):
            packets = (
                (packet, [_strand(*each, setup.sample_s) for each in rays.items()])
                for packet, rays in self.orbit.strands(number)
            )
            _deal_tiles(setup, packets, dealt)
        return dealt

    def deal(self, setup: Setup) -> list[list[list[Visits]]]:
        """Deal each rank its packets, by frame."""
        dealt: list[list[list[Visits]]] = [[] for _ in range(setup.ranks)]
        for number in range(setup.frames):
            packets = (
                (packet, Visits(cells, (samples * setup.sample_s).tolist()))
                for packet, cells, samples in self.frame(number)
            )
            if setup.by_curve:
                self._deal_runs(setup, number, dealt)
            else:
                _deal_tiles(setup, packets, dealt)
        return dealt

    def _deal_runs(
        self, setup: Setup, number: int, dealt: list[list[list[Visits]]]
    ) -> None:
        """Cut the curve where the work, which rays' lengths tell, is equal."""
        for frames in dealt:
            frames.append([])
        wide = self.orbit.image // self.orbit.packet
        frame = self.frame(number)
        whole, done = frame.samples, 0
        packets = sorted(frame, key=lambda p: morton_number(p[0] % wide, p[0] // wide))
        for _, cells, samples in packets:
            work = int(samples.sum())
            rank = (2 * done + work) * setup.ranks // (2 * whole)
            done += work
            visits = Visits(cells, (samples * setup.sample_s).tolist())
            dealt[min(rank, setup.ranks - 1)][number].append(visits)

    def balance(self, setup: Setup) -> float:
        """Return the mean load of a rank over the largest, frame by frame.

        No more efficiency is possible for this deal of the screen.
        """
        loads = np.zeros((setup.ranks, setup.frames))
        for rank, frames in enumerate(self.deal(replace(setup, sample_s=1.0))):
            loads[rank] = [sum(sum(p.seconds) for p in f) for f in frames]
        return float(loads.sum() / (loads.max(axis=0).sum() * setup.ranks))


def _strand(
    cells: tuple[int, ...], numbers: NDArray[np.float64], sample_s: float
) -> Strand:
    return Strand(cells, (numbers[:-1] * sample_s).tolist(), int(numbers[-1]))


def _deal_tiles(
    setup: Setup, packets: Iterable[tuple[int, T]], dealt: list[list[list[T]]]
) -> None:
    """Deal a frame's packets by tiles of the screen, in skewed cyclic order."""
    wide = setup.orbit.image // setup.orbit.packet
    tile = max(setup.tile // setup.orbit.packet, 1)
    by_tile: dict[tuple[int, int], list[T]] = {}
    for number, packet in packets:
        row, column = divmod(number, wide)
        by_tile.setdefault((row // tile, column // tile), []).append(packet)
    for frames in dealt:
        frames.append([])
    skew = skew_of(setup.ranks)
    for (ty, tx), lot in sorted(by_tile.items()):
        dealt[(tx + skew * ty) % setup.ranks][-1].extend(lot)


def payload_bytes(orbit: Orbit) -> int:
    """Return a cell's bytes on its way: one a voxel, with the ghosts of `CellGrid`."""
    return (orbit.cell + 3) ** 3


def simulate(setup: Setup, traces: Traces) -> Outcome:
    """Run the nodes that ship on a simulated machine."""
    orbit, costs = setup.orbit, setup.costs
    torus = Torus(setup.ranks, costs.link, costs.hop_s)
    nodes: list[Node[Visits]] = []
    watch: Callable[[Machine, Message], None] | None = None
    if setup.dataflow is Dataflow.RAYS:
        lots, slots = _ray_lots(setup, traces), -(-orbit.cells // setup.ranks)
    else:
        if setup.dataflow is Dataflow.REPLICATED:
            setup = replace(setup, cache=float(setup.ranks))
        slots = simulated_slots(setup)[0]
        lots = []
        for node, work, frames in _cell_lots(setup, traces, torus):
            nodes.append(node)
            lots.append((node, work, frames))
    if setup.dataflow in (Dataflow.RAYS, Dataflow.REPLICATED):
        # No cell ever goes, and so nobody asks which was used last.
        costs = replace(costs, touch_s=0.0)
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
        sum(lot[0].tally().get("rays_sent", 0) for lot in lots),
        sum(node.directory.moves for node in nodes),
        slots,
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
            rank,
            np.full(orbit.cells, rank) if alone else home,
            owner,
            torus.distances,
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


def _ray_lots(setup: Setup, traces: Traces) -> list[SimulatedRank]:
    """Make ranks between which rays travel, each with its share of the volume."""
    owner = deal_owners(np.ones(setup.orbit.cells, np.bool_), setup.ranks)
    begun: Begun = {}
    lots: list[SimulatedRank] = []
    for rank, frames in enumerate(traces.deal_strands(setup)):
        travel = StrandTravel(rank, owner, begun, slice_s=setup.costs.slice_s)
        lots.append((StrandRayNode(travel, rank), travel, frames))
    return lots


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
