"""Cells, rays or nothing between real ranks: the ways of the literature side by side.

Every row starts its ranks with mpiexec on this machine. Pictures are compared with one
process's, bit for bit; a row whose picture differs is an error.
"""

from functools import cached_property
from pathlib import Path

import msgspec
import numpy as np

from benchmarks.nasal_views import nasal_scene, path_views
from benchmarks.plan import Measured, Task
from benchmarks.ranks.mpi_frames import (
    RankJob,
    RankReport,
    run_ranks,
)
from benchmarks.ranks.orbits import folded_scene, orbit, write_folds
from benchmarks.schema import Setting
from benchmarks.suites.art_ranks import RanksPlan
from benchmarks.timing import Timing
from renderers.art.ranks.policy import Dataflow
from renderers.snapshots.client import SnapshotClient
from renderers.snapshots.request import ClassicWork, SnapshotRequest

LARGE_SIDE = 1024
LARGE_CELL = 16
LARGE_RANKS = 4
BRICK_BYTES = (LARGE_CELL + 1) ** 3 * 8
"""Of a cell of a large volume made ready: four int16 a voxel."""
RAW_BYTES = (LARGE_CELL + 3) ** 3 * 2
"""Of a cell as it is passed on, which ranks keep where cells migrate."""
LARGE_FLOWS = (Dataflow.STATIC, Dataflow.MIGRATING, Dataflow.REPLICATED)

Reports = list[RankReport]


class DataflowPlan(RanksPlan, suite="art-dataflow"):
    """List and make the measurements of suite `art-dataflow`."""

    def __init__(self, quick: bool) -> None:
        super().__init__(quick)
        self._side = 64 if quick else 96
        self._size = 128 if quick else 256

    def tasks(self) -> list[Task]:
        """List the tasks, baselines first."""
        tasks = []
        for animation in ("orbit 30",) if self.quick else ("orbit 30", "orbit 60"):
            tasks += [
                self._coherence(animation, share, tile)
                for share, tile in ((0.5, 32), (1.0, 32), (1.0, 16), (1.0, 64))
            ]
        if not self.quick:
            tasks += [
                self._coherence("demo's flight", share, 32) for share in (0.3, 1.0)
            ]
            tasks += [self._large(dataflow) for dataflow in LARGE_FLOWS]
        return tasks

    @cached_property
    def _orbit(self) -> tuple[SnapshotRequest, ...]:
        client, scene = SnapshotClient(self._folder), folded_scene(self._side)
        return tuple(
            client.request_classic(scene, camera)
            for camera in orbit(self._side, self._size, 60)
        )

    @cached_property
    def _flight(self) -> tuple[SnapshotRequest, ...]:
        client, scene = SnapshotClient(self._folder), nasal_scene("default")
        assert scene.surface is not None
        return tuple(
            client.request_scope(scene.surface, view.camera, samples=1)
            for view in path_views(self._size, 60)
        )

    def _coherence(self, animation: str, share: float, tile: int) -> Task:
        """Draw an animation; `share`: a cache's cells over those that can be seen."""

        def run() -> Measured:
            if animation == "demo's flight":
                requests = self._flight
            else:
                requests = self._orbit[: int(animation.split()[1])]
            job = RankJob(requests=requests[:1], dataflow="static", region_px=tile)
            occupied = run_ranks(4, job, self._folder)[0].occupied
            job = RankJob(
                requests=requests,
                cache_cells=max(int(share * occupied), occupied // 4 + 2),
                region_px=tile,
            )
            reports = run_ranks(4, job, self._folder)
            walls = [frame.wall_s for frame in reports[0].rounds[0]]
            by_frame = [
                _total(reports, 0, k, "cells_fetched") for k in range(len(walls))
            ]
            counters = {
                "occupied": float(occupied),
                "slots": float(reports[0].slots),
                "fetched_cold": by_frame[0],
                "fetched_warm": sum(by_frame[1:]) / (len(by_frame) - 1),
                "fetched_most_warm": max(by_frame[1:]),
                "fetched_whole": sum(by_frame),
                "cold_s": walls[0],
                "warm_s": float(np.median(walls[1:])),
            }
            counters |= {f"frame_{k:02}": n for k, n in enumerate(by_frame)}
            return Measured(Timing.of(walls[1:], walls[1:]), counters=counters)

        return self.task(
            f"coherence/{animation}/4 ranks",
            f"caches of {share:g} of the cells, tiles of {tile}",
            run,
            self._settings(4) | {"share": share, "tile": tile},
            clock="wall",
            cost_s=20.0,
        )

    def _large(self, dataflow: Dataflow) -> Task:
        """Draw a volume of which all caches together hold a quarter, in bytes.

        Nobody has to keep a cell: they are read from the mapped file. Empty cells are
        one brick.
        """
        migrates = dataflow is Dataflow.MIGRATING
        cell_bytes = BRICK_BYTES + (RAW_BYTES if migrates else 0)
        slots = 2 * LARGE_SIDE**3 // 4 // LARGE_RANKS // cell_bytes

        def run() -> Measured:
            job = RankJob(
                requests=large_requests(LARGE_SIDE, self._folder),
                dataflow=dataflow.value,
                cache_cells=slots,
                from_file=True,
                cell_side=LARGE_CELL,
            )
            reports = run_ranks(LARGE_RANKS, job, self._folder)
            frames = reports[0].rounds[0]
            self._same_bits("large", frames)
            walls = [frame.wall_s for frame in frames]
            counters = {
                "cache_mb_a_rank": slots * cell_bytes / 1e6,
                "slots": float(slots),
                "occupied": float(reports[0].occupied),
                "made_s": max(r.made_s[0] for r in reports),
                "cold_s": walls[0],
                "second_s": walls[1],
                "cells_fetched": _total(reports, 0, 0, "cells_fetched"),
                "cells_evicted": _total(reports, 0, 0, "cells_evicted"),
                "second_fetched": _total(reports, 0, 1, "cells_fetched"),
            }
            for report in reports:
                counters[f"own_mb_{report.rank}"] = report.own_bytes / 1e6
                counters[f"peak_own_mb_{report.rank}"] = report.peak_own_bytes / 1e6
                counters[f"peak_mb_{report.rank}"] = report.peak_bytes / 1e6
            return Measured(Timing.of(walls, walls), counters=counters)

        name, first = (
            f"{way.value}, from the file" for way in (dataflow, LARGE_FLOWS[0])
        )
        return self.task(
            f"larger than memory/{LARGE_SIDE}/{LARGE_RANKS} ranks",
            name,
            run,
            {"side": LARGE_SIDE, "cell": LARGE_CELL, "ranks": LARGE_RANKS},
            baseline=None if name == first else first,
            clock="wall",
            cost_s=240.0,
        )

    def _settings(self, ranks: int) -> dict[str, Setting]:
        return {"ranks": ranks, "side": self._side, "size": self._size, "cell": 8}


def large_requests(side: int, folder: Path) -> tuple[SnapshotRequest, ...]:
    """Ask for two frames of a volume that is only on disk."""
    digest = write_folds(side, folder / "data")
    client, part = SnapshotClient(folder), folded_scene(side, 2)
    requests = []
    for camera in orbit(side, 256, 2):
        request = client.request_classic(part, camera, quality="preview")
        assert isinstance(request.work, ClassicWork)
        work = msgspec.structs.replace(request.work, volume=digest)
        requests.append(msgspec.structs.replace(request, work=work))
    return tuple(requests)


def _total(reports: Reports, number: int, frame: int, name: str) -> float:
    return float(sum(r.rounds[number][frame].tally.get(name, 0) for r in reports))
