from pathlib import Path

import pytest

from renderers.art import ActiveRayTracer
from renderers.art.ranks.policy import CellPolicy, Dataflow
from renderers.scene import Camera, Image, Scene
from renderers.snapshots.client import SnapshotClient
from renderers.snapshots.request import ScopeWork
from renderers.snapshots.spool import Spool
from renderers.snapshots.worker import run_worker
from tests.renderers.snapshots.threaded_end import threaded_team

POLICY = CellPolicy(5, Dataflow.STATIC)


@pytest.fixture
def client(tmp_path: Path) -> SnapshotClient:
    return SnapshotClient(tmp_path / "spool")


def test_a_team_of_ranks_delivers_the_same_bytes(
    client: SnapshotClient, scene: Scene, outside: Camera
) -> None:
    good = client.request_classic(scene, outside)
    assert not isinstance(good.work, ScopeWork)
    cancelled = client.request_classic(scene, outside)
    client.cancel(cancelled.id)
    again = client.request_classic(scene, outside, samples=4)
    for request in (good, cancelled, again):
        client.submit(request)
    with threaded_team(Spool(client.spool.folder).data, POLICY) as team:
        served = run_worker(client.spool.folder, once=True, team=team)
    assert served == 3
    expected = ActiveRayTracer(scene).render(outside)
    snapshot = client.wait(good.id)
    assert snapshot.result.ranks == 3
    assert snapshot.result.counters["requests"] > 0
    assert snapshot.radiance().tobytes() == expected.rgba.tobytes()
    fine = ActiveRayTracer(scene).render(outside.with_size(100, 86))
    assert client.wait(again.id).radiance() == pytest.approx(
        fine.rgba.reshape(43, 2, 50, 2, 4).mean(axis=(1, 3)), abs=1e-6
    )
    assert isinstance(fine, Image)
