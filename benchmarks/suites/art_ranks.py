"""What real ranks of this machine bring: a first picture, an orbit, memory.

Every row starts its ranks with mpiexec. Pictures are compared with those of one rank,
bit for bit; a row whose picture differs is an error.
"""

import tempfile
from collections.abc import Sequence
from functools import cached_property
from pathlib import Path

from benchmarks.plan import Measured, Plan, Task, UnavailableError
from benchmarks.ranks.mpi_frames import FrameReport, RankJob, run_ranks
from benchmarks.ranks.orbits import folded_scene, orbit
from benchmarks.schema import Setting
from benchmarks.timing import Timing
from renderers.art.cells.cell_size import sent_side
from renderers.art.ranks.policy import Dataflow
from renderers.snapshots.client import SnapshotClient
from renderers.snapshots.launcher import find_launcher


class RanksPlan(Plan):
    """What suites with ranks have in common."""

    def __init__(self, quick: bool) -> None:
        super().__init__(quick)
        self._digests: dict[str, list[str]] = {}

    @cached_property
    def _folder(self) -> Path:
        if find_launcher() is None:
            raise UnavailableError("there is no mpiexec; install the extra `mpi`")
        scratch = tempfile.TemporaryDirectory(prefix="paravol-ranks-")
        return Path(self.stack.enter_context(scratch))

    def _same_bits(self, what: str, frames: Sequence[FrameReport]) -> None:
        """Compare pictures with those of the first row that drew the same."""
        digests = [frame.digest for frame in frames]
        if digests != self._digests.setdefault(what, digests):
            raise RuntimeError(f"other pictures were drawn of {what}")


class RealRanksPlan(RanksPlan, suite="art-ranks"):
    """List and make the measurements of suite `art-ranks`."""

    def tasks(self) -> list[Task]:
        """List the tasks, baselines first."""
        tasks = []
        for side, size in ((128, 256),) if self.quick else ((128, 256), (384, 512)):
            ways = [(1, Dataflow.SHARED), (2, Dataflow.SHARED), (4, Dataflow.SHARED)]
            ways += [(2, way) for way in Dataflow if way is not Dataflow.SHARED]
            tasks += [self._orbit_of(side, size, *way) for way in ways]
        return tasks

    def _orbit_of(self, side: int, size: int, ranks: int, way: Dataflow) -> Task:
        """Load, prepare and draw an orbit: how much more ranks bring than one."""
        cell = 16 if way is Dataflow.SHARED else sent_side(None)

        def run() -> Measured:
            client, scene = SnapshotClient(self._folder), folded_scene(side)
            requests = tuple(
                client.request_classic(scene, camera)
                for camera in orbit(side, size, 5 if self.quick else 30)
            )
            job = RankJob(
                requests=requests, dataflow=way.value, cell_side=cell, rounds=3
            )
            reports = run_ranks(ranks, job, self._folder)
            cold, whole = [], []
            # The first round compiles.
            for made_s, drawn in zip(
                reports[0].made_s[1:], reports[0].rounds[1:], strict=True
            ):
                self._same_bits(f"orbit of {side}", drawn)
                cold.append(made_s + drawn[0].wall_s)
                whole.append(made_s + sum(frame.wall_s for frame in drawn))
            counters = {
                "cold_s": min(cold),
                "own_mb": max(r.own_bytes for r in reports) / 1e6,
                "shared_mb": max(r.shared_bytes for r in reports) / 1e6,
            }
            return Measured(Timing.of(whole, whole), counters=counters)

        name = f"{ranks} ranks, {way.value}"
        settings: dict[str, Setting] = {"ranks": ranks, "side": side, "size": size}
        return self.task(
            f"orbit of {side}",
            name,
            run,
            settings | {"cell": cell, "dataflow": way.value},
            baseline=None if ranks == 1 else "1 ranks, shared",
            clock="wall",
            cost_s=60.0 if side == 384 else 5.0,
        )
