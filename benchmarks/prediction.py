"""What the simulator says of runs that real ranks then make, on this machine.

What work costs is learned from one rank, what messages cost from two ranks that only
ask for cells; nothing is learned from the runs that are predicted.
"""

import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

from benchmarks.ranks import RankJob, RankReport, run_ranks
from renderers.art.data_store import DataStore
from renderers.art.directory import Distances
from renderers.art.ledger import Ledger
from renderers.art.march import FrameRays
from renderers.art.messages import Message, MessageKind
from renderers.art.node import Node
from renderers.art.node_maker import make_node
from renderers.art.policy import Dataflow
from renderers.art.regions import deal_regions
from renderers.art.simulator.machine import Costs, Machine
from renderers.art.simulator.retrace import Retracing, twin
from renderers.art.simulator.strands import (
    FEATURES,
    StrandPacket,
    StrandWork,
    record_packet,
)
from renderers.art.simulator.torus import Torus
from renderers.art.stage import load_scene
from renderers.art.team import mode_of, traced_camera

ASKS = 2000
AT_ONCE = 16
"""Cells asked for side by side: packets miss several at a time."""

COPIED = 20_000
"""Bytes of the message that tells what copying costs: a region's."""


@dataclass(frozen=True, slots=True)
class Learned:
    """Hold what a machine's work and messages cost.

    work: s, by `FEATURES`. cut_s: of a brick's, cutting it from the whole volume, which
    one of several ranks has done before.
    """

    work: NDArray[np.float64]
    cut_s: float
    costs: Costs


@dataclass(frozen=True, slots=True)
class Predicted:
    """Say what was predicted: seconds by frame, ledgers, messages by kind."""

    frame_s: list[float]
    ledgers: list[Ledger]
    sent: dict[str, int]

    @property
    def busy_s(self) -> float:
        """Get the processor time of all ranks."""
        return sum(ledger.busy for ledger in self.ledgers)


class Predictor:
    """Know a job's rays; learn costs; predict."""

    def __init__(self, job: RankJob, folder: Path) -> None:
        """Take a job whose data are in `folder`."""
        self._job = job
        self._folder = folder
        first = job.requests[0]
        self._scene = load_scene(DataStore(folder / "data"), first)
        self._quality = first.to_quality()
        self._mode = mode_of(first)
        self._march, _, self._lone = make_node(
            self._scene,
            self._mode,
            self._quality,
            cell_side=job.cell_side,
            cache_cells=1,
        )
        self._strands: dict[int, list[list[list[StrandPacket]]]] = {}

    def strands(self, ranks: int) -> list[list[list[StrandPacket]]]:
        """Record every packet, by rank and frame."""
        if ranks not in self._strands:
            made: list[list[list[StrandPacket]]] = [[] for _ in range(ranks)]
            for request in self._job.requests:
                camera = traced_camera(request)
                rays = FrameRays.of(camera)
                for rank, frames in enumerate(made):
                    regions = deal_regions(
                        camera.width, camera.height, rank, ranks, self._job.region_px
                    )
                    packets = (self._march.start(region, rays) for region in regions)
                    frames.append([record_packet(p, self._lone) for p in packets])
            self._strands[ranks] = made
        return self._strands[ranks]

    def nodes(
        self, ranks: int, costs: NDArray[np.float64] | None = None
    ) -> list[Node[StrandPacket]]:
        """Make simulated nodes like those the job's ranks have."""
        found = []
        for rank in range(ranks):
            _, node, _ = make_node(
                self._scene,
                self._mode,
                self._quality,
                rank=rank,
                ranks=ranks,
                dataflow=Dataflow(self._job.dataflow),
                distances=_same_machine(ranks),
                cell_side=self._job.cell_side,
                cache_cells=self._job.cache_cells,
                from_file=self._job.from_file,
            )
            found.append(twin(node, costs))
        return found

    def retrace(self, ranks: int, number: int = 0) -> Retracing:
        """Make simulated nodes do what the recorded ranks of a round did."""
        events = [self._recorded(rank, number)["events"] for rank in range(ranks)]
        retracing = Retracing(self.nodes(ranks), events, self.strands(ranks))
        retracing.run()
        return retracing

    def learn(self, *launcher: str) -> Learned:
        """Measure one rank, and two that only ask."""
        job = replace_job(self._job, recorded=True, rounds=3, clock="cpu")
        (report,) = run_ranks(1, job, self._folder, *launcher)
        last = job.rounds - 1
        moves = np.array(self.retrace(1, last).moves[0])
        work = np.diff(moves, axis=0, prepend=0.0)
        recorded = [self._recorded(0, number)["move_s"] for number in range(job.rounds)]
        # The same moves every time: the quickest is the least disturbed.
        seconds = np.min(recorded, axis=0)
        learned, _ = nnls(work[:, 1:], seconds)
        render_s = sum(frame.ledger["render"] for frame in report.rounds[last])
        set_up_s = (render_s - float(recorded[last].sum())) / moves[-1, 0]
        whole = np.array([max(set_up_s, 0.0), *learned])
        return Learned(whole, self._cut_s(), self._costs(*launcher))

    def predict(self, ranks: int, learned: Learned) -> Predicted:
        """Simulate the job."""
        work = learned.work.copy()
        if ranks > 1:
            shows = FEATURES.index("shows")
            work[shows] = max(work[shows] - learned.cut_s, 0.0)
        nodes = self.nodes(ranks, work)
        lots = []
        for node, frames in zip(nodes, self.strands(ranks), strict=True):
            assert isinstance(node.work, StrandWork)
            fresh = [[packet.fresh() for packet in frame] for frame in frames]
            lots.append((node, node.work, fresh))
        costs = learned.costs
        torus = Torus(ranks, costs.link, costs.hop_s)
        size = self._lone.share.block(0).nbytes
        machine = Machine(costs, torus, lots, payload_bytes=size, in_step=True)
        machine.run()
        ends = machine.frame_ends()
        return Predicted(
            [b - a for a, b in zip([0.0, *ends], ends, strict=False)],
            machine.ledgers,
            {kind.name: n for kind, n in machine.sent.items()},
        )

    def _cut_s(self) -> float:
        share, took = self._lone.share, []
        cells = np.linspace(0, share.grid.cells - 1, 200).astype(int).tolist()
        for _ in range(3):
            began = time.thread_time()
            for cell in cells:
                share.block(cell)
            took.append((time.thread_time() - began) / len(cells))
        return min(took)

    def _costs(self, *launcher: str) -> Costs:
        """Measure messages."""
        job = RankJob(visits=ASKS, at_once=AT_ONCE, clock="cpu")
        reports = run_ranks(2, job, self._folder, *launcher)
        asked = sum(len(report.latency_s) for report in reports)
        ledger = {
            name: sum(r.rounds[0][0].ledger[name] for r in reports) / asked
            for name in ("directory", "receive", "send")
        }
        message = Message(MessageKind.REGION, 0, 1, 1, payload=bytes(COPIED))
        small = message._replace(payload=b"")
        times = []
        for one in (message, small):
            best = np.inf
            for _ in range(200):
                began = time.perf_counter()
                Message.decode(one.encode())
                best = min(best, time.perf_counter() - began)
            times.append(best)
        # A request and a cell make two messages; both are taken, and what is done about
        # either is alike.
        taken = max(ledger["receive"] - ledger["directory"], 0.0)
        return Costs(
            send_s=ledger["send"] / 2,
            receive_s=taken / 2,
            handle_s=ledger["directory"],
            copy_s=(times[0] - times[1]) / COPIED / 2,
            poll_s=0.5e-6,
            scan_s=0.0,
            slice_s=0.0,
            link=1e10,
            hop_s=2e-6,
            own_s=0.0,
        )

    def _recorded(self, rank: int, number: int) -> dict[str, NDArray[Any]]:
        path = self._folder / f"rank-{rank}-round-{number}.npz"
        with np.load(path, allow_pickle=False) as kept:
            return dict(kept)


def replace_job(job: RankJob, **changes: Any) -> RankJob:
    """Change a job."""
    return msgspec.structs.replace(job, **changes)


def measured_busy_s(reports: Sequence[RankReport], number: int) -> float:
    """Get the processor time that all ranks spent on a round, waiting apart."""
    return sum(
        Ledger(**frame.ledger).busy for r in reports for frame in r.rounds[number]
    )


def _same_machine(ranks: int) -> Distances:
    """Measure as `MpiTransport` does where all ranks share a machine."""

    def distances(rank: int) -> list[int]:
        return [int(other != rank) for other in range(ranks)]

    return distances
