"""A thousand queued jobs are drained; neither memory nor the spool folder grows."""

import gc
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from renderers.art.job_steps import Step, reached
from renderers.scene import Camera, Projection
from renderers.snapshots.client import SnapshotClient
from renderers.snapshots.pruning import Pruner
from renderers.snapshots.spool import JobState
from renderers.snapshots.worker import run_worker
from tests.stress.jobs import small_scene

JOBS = 1000
WARM = 200
"""Jobs until everything that is kept has been made."""

LOOK_EVERY = 20

CACHE_BYTES = 1 << 20
"""Room for views that need not be drawn again: full long before all is warm."""

MOST_PER_JOB = 600
"""Bytes of Python's memory that may stay for each job. A picture of these has 8,000."""

MOST_RESIDENT_PER_JOB = 4_000
"""Bytes of the process's memory: what fragments of pages add to that."""


def without_largest_step(sizes: NDArray[np.float64]) -> NDArray[np.float64]:
    """Take the largest step out of sizes.

    Names of files pass through the interpreter's table of strings, which is made anew,
    some MB at once, when it is full: after many other tests that happens here. It
    cannot happen twice, since the table doubles.
    """
    steps = np.diff(sizes)
    steps[np.argmax(steps)] = 0
    return np.concatenate(([0.0], np.cumsum(steps)))


def resident_bytes() -> int:
    """Read how much memory this process has."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * 4096


@pytest.mark.slow
@pytest.mark.timeout(1500)
def test_a_thousand_jobs_are_drained_without_growth(tmp_path: Path) -> None:
    scene = small_scene()
    client = SnapshotClient(tmp_path / "spool")
    rng = np.random.default_rng(8)
    for _ in range(JOBS):
        camera = Camera.looking_at(
            20 * rng.normal(size=3) + [30, 0, 0],
            [0, 0, 0],
            extent=0.5,
            size=(16, 16),
            projection=Projection.PERSPECTIVE,
        )
        priority = int(rng.integers(10))
        request = client.request_classic(
            scene, camera, quality="preview", priority=priority
        )
        client.submit(request)
    ended = 0
    seen: list[tuple[int, int, int]] = []

    def watch(step: Step) -> None:
        nonlocal ended
        if step is Step.JOB_ENDED:
            ended += 1
            if ended > WARM and ended % LOOK_EVERY == 0:
                gc.collect()
                traced = tracemalloc.get_traced_memory()[0]
                seen.append((ended, traced, resident_bytes()))

    waiting = [path.name for path in client.spool.queue.iterdir()]
    tracemalloc.start()
    reached.watcher = watch
    try:
        served = run_worker(
            client.spool.folder, once=True, threads=1, cache_bytes=CACHE_BYTES
        )
    finally:
        reached.watcher = None
        tracemalloc.stop()
    assert served == JOBS
    jobs, sizes, resident = np.array(seen, np.float64).T
    grown = np.polyfit(jobs, without_largest_step(sizes), 1)[0]
    spread = np.polyfit(jobs, resident, 1)[0]
    print(f"{grown:.0f} bytes a job in Python, {spread:.0f} resident")
    assert grown < MOST_PER_JOB
    assert spread < MOST_RESIDENT_PER_JOB
    assert not list(client.spool.queue.iterdir())
    assert len(waiting) == JOBS
    for name in waiting:
        job_id = name.partition("-")[2].removesuffix(".json")
        assert client.spool.status(job_id).state is JobState.DONE
    # Served by priority, and among equals in the order of asking.
    in_turn = sorted(
        waiting,
        key=lambda name: (
            client.spool.attempt_folder(name.partition("-")[2].removesuffix(".json"))
            .joinpath("result.json")
            .stat()
            .st_mtime_ns
        ),
    )
    assert [name[0] for name in in_turn] == sorted(name[0] for name in waiting)
    Pruner(client.spool, 0.0, 0.0).prune()
    assert not list(client.spool.jobs.iterdir())
    assert not list((client.spool.folder / "data").iterdir())
