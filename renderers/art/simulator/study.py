"""An orbit drawn by simulated ranks, set up as the paper's measurements were."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from renderers.art.audit import audit
from renderers.art.cache import CellCache
from renderers.art.directory import Directory, deal_owners, homes
from renderers.art.ledger import Ledger
from renderers.art.messages import Message, MessageKind
from renderers.art.node import MOST_PENDING, Node
from renderers.art.node_maker import MOST_WORKING
from renderers.art.policy import Dataflow
from renderers.art.regions import curve_key, skew_of
from renderers.art.simulator.machine import Costs, Lot, Machine
from renderers.art.simulator.replay import ReplayWork, Visits
from renderers.art.simulator.torus import Torus
from renderers.art.simulator.trace import FrameTrace, Orbit

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
    the screen. random_holder: forward to any holder, not the nearest. by_curve: each
    rank has one run of packets along a Morton curve, all runs with equal work; else
    regions in skewed cyclic order. scattered: cells begin at ranks drawn at random, not
    in runs.
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
    random_holder: bool = False
    by_curve: bool = False
    scattered: bool = False
    validate: bool = False


@dataclass(frozen=True, slots=True)
class Outcome:
    """Say what a simulated run found.

    seconds: of the whole; frame_s: by frame, from the last rank's end to the last
    rank's end. cells_fetched: by all ranks. slots: a rank's.
    """

    setup: Setup
    seconds: float
    frame_s: list[float]
    ledgers: list[Ledger]
    sent: dict[str, int]
    data_by_hops: dict[int, int]
    cells_fetched: int
    deferrals: int
    owners_moved: int
    slots: int
    events: int

    def shares(self) -> dict[str, float]:
        """Get each part of the ledger as a share of all ranks' time."""
        whole = self.seconds * len(self.ledgers)
        total: dict[str, float] = {}
        for ledger in self.ledgers:
            for name, seconds in ledger.parts().items():
                total[name] = total.get(name, 0.0) + seconds / whole
        return total

    @property
    def overhead(self) -> float:
        """Get the share of send start-ups, messages and directory in the time."""
        shares = self.shares()
        return shares["send"] + shares["receive"] + shares["directory"]


class Traces:
    """Trace each frame of an orbit once, for all runs."""

    def __init__(self, orbit: Orbit) -> None:
        self.orbit = orbit
        self._frames: dict[int, FrameTrace] = {}

    def frame(self, number: int) -> FrameTrace:
        """Get a frame."""
        if number not in self._frames:
            self._frames[number] = self.orbit.frame(number)
        return self._frames[number]

    def samples(self, frames: int) -> int:
        """Count the samples of the first frames."""
        return sum(self.frame(k).samples for k in range(frames))

    def deal(self, setup: Setup) -> list[list[list[Visits]]]:
        """Give each rank its packets, by frame."""
        wide = self.orbit.image // self.orbit.packet
        tile = max(setup.tile // self.orbit.packet, 1)
        skew = skew_of(setup.ranks)
        dealt: list[list[list[Visits]]] = [[] for _ in range(setup.ranks)]
        for number in range(setup.frames):
            for frames in dealt:
                frames.append([])
            if setup.by_curve:
                self._deal_runs(setup, number, dealt)
                continue
            by_tile: dict[tuple[int, int], list[Visits]] = {}
            for packet, cells, samples in self.frame(number):
                row, column = divmod(packet, wide)
                visits = Visits(cells, (samples * setup.sample_s).tolist())
                by_tile.setdefault((row // tile, column // tile), []).append(visits)
            for (ty, tx), packets in sorted(by_tile.items()):
                dealt[(tx + skew * ty) % setup.ranks][number].extend(packets)
        return dealt

    def _deal_runs(
        self, setup: Setup, number: int, dealt: list[list[list[Visits]]]
    ) -> None:
        """Cut the curve where the work, which rays' lengths tell, is equal."""
        wide = self.orbit.image // self.orbit.packet
        frame = self.frame(number)
        whole, done = frame.samples, 0
        packets = sorted(frame, key=lambda p: curve_key(p[0] % wide, p[0] // wide))
        for _, cells, samples in packets:
            work = int(samples.sum())
            rank = (2 * done + work) * setup.ranks // (2 * whole)
            done += work
            visits = Visits(cells, (samples * setup.sample_s).tolist())
            dealt[min(rank, setup.ranks - 1)][number].append(visits)

    def balance(self, setup: Setup) -> float:
        """Get the mean over the largest load of a rank, frame by frame: the most that
        the deal of the screen allows, whatever messages cost."""
        loads = np.zeros((setup.ranks, setup.frames))
        for rank, frames in enumerate(self.deal(replace(setup, sample_s=1.0))):
            loads[rank] = [sum(sum(p.seconds) for p in f) for f in frames]
        return float(loads.sum() / (loads.max(axis=0).sum() * setup.ranks))


def payload_bytes(orbit: Orbit) -> int:
    """Get a cell's bytes on its way: one a voxel, with the ghosts of `CellGrid`."""
    return (orbit.cell + 3) ** 3


def simulate(setup: Setup, traces: Traces) -> Outcome:
    """Run the nodes that ship on a simulated machine; not those where rays travel."""
    if setup.dataflow is Dataflow.RAYS:
        raise ValueError("the simulator moves cells; rays travel on real ranks only")
    orbit, ranks = setup.orbit, setup.ranks
    torus = Torus(ranks, setup.costs.link, setup.costs.hop_s)
    migrates = setup.dataflow is Dataflow.MIGRATING and ranks > 1
    home = homes(orbit.cells, ranks)
    owner = deal_owners(np.ones(orbit.cells, np.bool_), ranks)
    if setup.scattered:
        owner = owner[np.random.default_rng(1).permutation(orbit.cells)]
    if setup.dataflow is Dataflow.REPLICATED:
        setup = replace(setup, cache=float(ranks))
    slots, quota = simulated_slots(setup)
    made: list[Lot] = []
    packets = traces.deal(setup)
    random = np.random.default_rng(0)

    def no_distance(rank: int) -> list[int]:
        return [int(n) for n in random.integers(0, 1 << 30, ranks)]

    for rank in range(ranks):
        cache = CellCache(slots, quota if migrates else 0)
        if migrates:
            for cell in np.flatnonzero(owner == rank).tolist():
                cache.own(cell)
        alone = setup.dataflow is Dataflow.REPLICATED
        work = ReplayWork(cache, slice_s=setup.costs.slice_s, checks=migrates)
        place = Directory(
            rank,
            np.full(orbit.cells, rank) if alone else home,
            owner,
            no_distance if setup.random_holder else torus.distances,
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
        made.append((node, work, packets[rank]))
    watch: Callable[[Machine, Message], None] | None = None
    if setup.validate and migrates:

        def watch(machine: Machine, message: Message) -> None:
            audit(machine.nodes, machine.flying(), (message.cell,))

    machine = Machine(
        setup.costs, torus, made, payload_bytes=payload_bytes(orbit), watch=watch
    )
    seconds = machine.run()
    if migrates:
        audit(machine.nodes, machine.flying())
    ends = machine.frame_ends()
    return Outcome(
        setup,
        seconds,
        [b - a for a, b in zip([0.0, *ends], ends, strict=False)],
        machine.ledgers,
        {kind.name: machine.sent[kind] for kind in MessageKind if machine.sent[kind]},
        dict(sorted(machine.data_by_hops.items())),
        sum(node.cache.fetches for node in machine.nodes),
        sum(node.cache.deferrals for node in machine.nodes),
        sum(node.directory.moves for node in machine.nodes),
        slots,
        machine.events,
    )


def simulated_slots(setup: Setup) -> tuple[int, int]:
    """Get a rank's slots and its quota of owned cells.

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
    """Get the one factor that makes one rank need what the paper's needed.

    128 voxels: one rank's time. 256: four ranks', at full efficiency; that table has
    no smaller number.
    """
    ranks, seconds = min(PAPER_S[side].items())
    return seconds * ranks * (frames / 30) / traces.samples(frames)
