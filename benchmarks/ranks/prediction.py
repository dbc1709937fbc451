"""What the simulator says of runs that real ranks then make, on this machine.

What work costs is learned from one rank, what messages and waiting cost from ranks that
draw nothing, and how processes slow each other down from two that do not know each
other; nothing is learned from the runs that are predicted.
"""

import os
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

from benchmarks.ranks.calibration import ROUNDS, contention_factor, learn_host
from benchmarks.ranks.mpi_frames import RankJob, RankReport, busy_s, run_ranks
from benchmarks.simulated_ranks.host import Host, HostCosts
from benchmarks.simulated_ranks.retrace import (
    Retracing,
    simulated_node,
    simulated_ray_node,
)
from benchmarks.simulated_ranks.simulated_machine import SimulatedRank
from benchmarks.simulated_ranks.strands import (
    FEATURES,
    StrandPacket,
    StrandWork,
    record_packet,
)
from benchmarks.simulated_ranks.trips import Begun, StrandRayNode, StrandTravel
from renderers.art.march import FrameRays
from renderers.art.ranks.directory import Distances
from renderers.art.ranks.ledger import Ledger
from renderers.art.ranks.messages import CELL_KINDS
from renderers.art.ranks.node import Node
from renderers.art.ranks.policy import CellPolicy, Dataflow
from renderers.art.ranks.prepare import make_node
from renderers.art.regions import deal_regions
from renderers.snapshots.data_store import DataStore
from renderers.snapshots.scene_loader import load_scene
from renderers.snapshots.team import mode_of, traced_camera

_OF_CELLS = frozenset(kind.name for kind in CELL_KINDS)

REGIONS_PX = (16, 64)
"""Edges of the regions that one rank draws to show what work costs: many small packets
tell a packet's cost from its rays'."""


@dataclass(frozen=True, slots=True)
class Learned:
    """Hold what a machine's work and messages cost.

    work: s, by `FEATURES`. cut_s: of a brick's, cutting it from the whole volume, which
    one of several ranks has done before. host: of messages and waiting.
    """

    work: NDArray[np.float64]
    cut_s: float
    host: HostCosts


@dataclass(frozen=True, slots=True)
class Predicted:
    """Say what was predicted: seconds by frame, ledgers, messages by kind."""

    frame_s: list[float]
    ledgers: list[Ledger]
    sent: dict[str, int]

    @property
    def busy_s(self) -> float:
        """Return the processor time of all ranks."""
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
            policy=CellPolicy(1),
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
    ) -> list[Node[StrandPacket] | StrandRayNode]:
        """Make simulated nodes like those the job's ranks have."""
        found: list[Node[StrandPacket] | StrandRayNode] = []
        begun: Begun = {}
        dataflow = Dataflow(self._job.dataflow)
        for rank in range(ranks):
            _, node, _ = make_node(
                self._scene,
                self._mode,
                self._quality,
                rank=rank,
                ranks=ranks,
                policy=CellPolicy(self._job.cache_cells, dataflow, self._job.from_file),
                distances=_same_machine(ranks),
                cell_side=self._job.cell_side,
            )
            if dataflow is Dataflow.RAYS:
                found.append(simulated_ray_node(node, begun, costs))
            else:
                found.append(simulated_node(node, costs))
        return found

    def retrace(self, ranks: int, number: int = 0) -> Retracing:
        """Make simulated nodes do what the recorded ranks of a round did."""
        events = [self._recorded(rank, number)["events"] for rank in range(ranks)]
        retracing = Retracing(self.nodes(ranks), events, self.strands(ranks))
        retracing.run()
        return retracing

    def learn(self, *launcher: str) -> Learned:
        """Measure one rank, ranks that only ask, and two that say nothing."""
        # A rank on its own would read values without looking cells up.
        plain = replace_job(self._job, rounds=ROUNDS, clock="cpu", from_file=True)
        drawn = replace_job(plain, recorded=True)
        work, seconds, starts, before_s = [], [], [], []
        frames = len(drawn.requests)
        for region_px in REGIONS_PX:
            job = replace_job(drawn, region_px=region_px)
            (report,) = run_ranks(1, job, self._folder, *launcher)
            twin = Predictor(job, self._folder)
            moves = np.array(twin.retrace(1).moves[0])
            recorded = [self._recorded(0, k)["move_s"] for k in range(ROUNDS)]
            best = min(recorded, key=np.sum)
            work.append(np.diff(moves, axis=0, prepend=0.0)[:, 1:])
            seconds.append(best)
            packets = sum(len(frame) for frame in twin.strands(1)[0])
            starts.append([packets, moves[-1, 0]])
            before_s.append(
                min(
                    sum(frame.ledger["render"] for frame in report.rounds[k])
                    - float(recorded[k].sum())
                    for k in range(ROUNDS)
                )
            )
        learned, _ = nnls(np.concatenate(work), np.concatenate(seconds))
        table_s = self._table_s()
        left_s = np.maximum(np.array(before_s) - table_s * frames, 0.0)
        (packet_s, start_s), _ = nnls(np.array(starts), left_s)
        plain = replace_job(plain, recorded=False)
        busy = contention_factor(plain, self._folder, *launcher)
        host = learn_host(self._folder, *launcher)
        return Learned(
            np.array([start_s, *learned]),
            self._cut_s(),
            replace(host, frame_s=table_s, packet_s=packet_s, busy=busy),
        )

    def predict(
        self, ranks: int, learned: Learned, cores: int | None = None
    ) -> Predicted:
        """Simulate the job; cores: processors, those of this machine by default."""
        work = learned.work.copy()
        if ranks > 1:
            shows = FEATURES.index("shows")
            work[shows] = max(work[shows] - learned.cut_s, 0.0)
        lots: list[SimulatedRank] = []
        nodes = self.nodes(ranks, work)
        for node, frames in zip(nodes, self.strands(ranks), strict=True):
            spender = node.work
            assert isinstance(spender, StrandWork | StrandTravel)
            fresh = [[packet.fresh() for packet in frame] for frame in frames]
            lots.append((node, spender, fresh))
        cores = cores or len(os.sched_getaffinity(0))
        size = self._lone.share.block(0).nbytes
        host = Host(learned.host, cores, lots, payload_bytes=size)
        frame_s = host.run()
        return Predicted(
            frame_s, host.ledgers, {kind.name: n for kind, n in host.sent.items()}
        )

    def compare(
        self, ranks: int, learned: Learned, *launcher: str
    ) -> tuple[dict[str, float], list[float], list[RankReport]]:
        """Predict, then draw; get figures, seconds by round, and what ranks reported.

        The job must be recorded: its messages are said again by simulated nodes.
        """
        said = self.predict(ranks, learned)
        reports = run_ranks(ranks, self._job, self._folder, *launcher)
        sent = self.retrace(ranks).sent
        timed = replace_job(self._job, recorded=False)
        reports = run_ranks(ranks, timed, self._folder, *launcher)
        walls = [sum(f.wall_s for f in frames) for frames in reports[0].rounds]
        charged = run_ranks(
            ranks, replace_job(timed, clock="cpu"), self._folder, *launcher
        )
        busy = min(busy_s(charged, k) for k in range(self._job.rounds))
        counters = {
            "predicted_s": sum(said.frame_s),
            "predicted_cold_s": said.frame_s[0],
            "predicted_busy_s": said.busy_s,
            "measured_busy_s": busy,
            "time_off": sum(said.frame_s) / min(walls) - 1,
            "busy_off": said.busy_s / busy - 1,
            "messages_retraced": float(sum(sent.values())),
            "messages_predicted": float(
                sum(n for name, n in said.sent.items() if name in _OF_CELLS)
            ),
            "message_us": 1e6 * learned.host.message_s,
            "bundle_us": 1e6 * learned.host.bundle_s,
            "switch_us": 1e6 * learned.host.switch_s,
            "busy": learned.host.busy,
        }
        return counters, walls, reports

    def _table_s(self) -> float:
        """Return what a rank does before its first ray: the picture's lens, whole."""
        best = np.inf
        for request in self._job.requests:
            camera = traced_camera(request)
            began = time.thread_time()
            FrameRays.of(camera)
            best = min(best, time.thread_time() - began)
        return best

    def _cut_s(self) -> float:
        share, took = self._lone.share, []
        cells = np.linspace(0, share.grid.cells - 1, 200).astype(int).tolist()
        for _ in range(3):
            began = time.thread_time()
            for cell in cells:
                share.block(cell)
            took.append((time.thread_time() - began) / len(cells))
        return min(took)

    def _recorded(self, rank: int, number: int) -> dict[str, NDArray[Any]]:
        path = self._folder / f"rank-{rank}-round-{number}.npz"
        with np.load(path, allow_pickle=False) as kept:
            return dict(kept)


def replace_job(job: RankJob, **changes: Any) -> RankJob:
    """Change a job."""
    return msgspec.structs.replace(job, **changes)


def _same_machine(ranks: int) -> Distances:
    """Measure as `MpiTransport` does where all ranks share a machine."""

    def distances(rank: int) -> list[int]:
        return [int(other != rank) for other in range(ranks)]

    return distances
