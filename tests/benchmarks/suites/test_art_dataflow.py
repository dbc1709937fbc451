from pathlib import Path

import numpy as np
import pytest

from benchmarks.ranks.mpi_frames import RankJob, digest_of, run_ranks
from benchmarks.ranks.orbits import folded_scene, orbit, write_folds
from benchmarks.suites.art_dataflow import LARGE_FLOWS, large_requests
from renderers.art import ActiveRayTracer
from renderers.art.ranks.policy import Dataflow
from renderers.art.regions import Gather
from renderers.snapshots.data_store import DataStore
from renderers.snapshots.launcher import find_launcher

SIDE = 64


def test_a_volume_written_layer_by_layer_is_the_whole(tmp_path: Path) -> None:
    digest = write_folds(16, tmp_path)
    values = DataStore(tmp_path).get(digest, ("int16",), 1 << 20)
    assert np.array_equal(values, folded_scene(16).volume.values)


@pytest.mark.mpi
@pytest.mark.slow
@pytest.mark.skipif(find_launcher() is None, reason="there is no mpiexec")
@pytest.mark.parametrize("dataflow", LARGE_FLOWS)
def test_a_volume_that_no_rank_holds_is_drawn_with_the_same_bits(
    tmp_path: Path, dataflow: Dataflow
) -> None:
    job = RankJob(
        requests=large_requests(SIDE, tmp_path),
        dataflow=dataflow.value,
        cache_cells=5,
        from_file=True,
        cell_side=16,
    )
    reports = run_ranks(4, job, tmp_path)
    frames = reports[0].rounds[0]
    tracer = ActiveRayTracer(folded_scene(SIDE), "preview", threads=1)
    for frame, camera in zip(frames, orbit(SIDE, 256, 2), strict=True):
        image = tracer.render(camera)
        assert image.depth_mm is not None
        gather = Gather(camera.width, camera.height)
        gather.value, gather.depth = image.rgba, image.depth_mm
        assert frame.digest == digest_of(gather)
    # All caches together have room for fewer cells than can be seen, and were full.
    assert sum(r.slots for r in reports) < reports[0].occupied
    assert all(r.rounds[0][0].tally["cells_evicted"] > 0 for r in reports)
