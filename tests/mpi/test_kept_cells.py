"""What real ranks keep from frame to frame."""

from pathlib import Path

import numpy as np
import pytest

from benchmarks.ranks.mpi_frames import RankJob, RankReport, digest_of, run_ranks
from renderers.art import ActiveRayTracer
from renderers.art.ranks.policy import Dataflow
from renderers.art.regions import Gather
from renderers.scene import Camera, Projection, Scene
from renderers.snapshots.client import SnapshotClient
from tests.mpi.launching import NEEDS_RANKS

pytestmark = NEEDS_RANKS
SIZE = 64


def orbit(steps_deg: list[float]) -> list[Camera]:
    """Look at the volume from around."""
    turns = np.radians(steps_deg)
    return [
        Camera.looking_at(
            [60 * np.cos(turn), 60 * np.sin(turn), 15],
            [0, 0, 0],
            extent=34,
            size=(SIZE, SIZE),
            projection=Projection.ORTHOGRAPHIC,
        )
        for turn in turns
    ]


def job(folder: Path, scene: Scene, steps_deg: list[float]) -> RankJob:
    client = SnapshotClient(folder)
    requests = (client.request_classic(scene, c) for c in orbit(steps_deg))
    return RankJob(requests=tuple(requests))


def fetched(reports: list[RankReport], frame: int) -> int:
    return sum(report.rounds[0][frame].tally["cells_fetched"] for report in reports)


@pytest.mark.parametrize("dataflow", [Dataflow.MIGRATING, Dataflow.SHARED])
def test_a_frame_drawn_again_fetches_nothing(
    tmp_path: Path, scene: Scene, dataflow: Dataflow
) -> None:
    drawn = job(tmp_path, scene, [0.0, 0.0, 90.0, 0.0])
    drawn = RankJob(requests=drawn.requests, dataflow=dataflow.value, region_px=16)
    reports = run_ranks(2, drawn, tmp_path)
    digests = [frame.digest for frame in reports[0].rounds[0]]
    assert digests[0] == digests[1] == digests[3] != digests[2]
    tracer = ActiveRayTracer(scene, "snapshot", threads=1)
    image = tracer.render(orbit([90.0])[0])
    assert image.depth_mm is not None
    gather = Gather(SIZE, SIZE)
    gather.value, gather.depth = image.rgba, image.depth_mm
    assert digests[2] == digest_of(gather)
    if dataflow is Dataflow.MIGRATING:
        assert fetched(reports, 0) > 0
        assert fetched(reports, 1) == 0
        assert fetched(reports, 3) == 0
    else:
        assert all(report.shared_bytes > 0 for report in reports)
