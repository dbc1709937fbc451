from pathlib import Path

import numpy as np
import pytest

from renderers.art.regions import Region
from renderers.scene import Camera, Scene
from renderers.snapshots.client import Samples, SnapshotClient
from renderers.snapshots.delivery import Finisher
from renderers.snapshots.growing import FILE_NAME, GrowingPicture
from renderers.snapshots.preview import Preview
from renderers.snapshots.progressive import trace_best
from renderers.snapshots.request import SnapshotRequest
from renderers.snapshots.spool import Spool
from renderers.snapshots.team import SerialTeam
from renderers.snapshots.traced import Traced, empty_gather
from renderers.snapshots.worker import run_worker

SIZE = (150, 130)


@pytest.fixture
def client(tmp_path: Path) -> SnapshotClient:
    return SnapshotClient(tmp_path / "spool")


def begin(client: SnapshotClient, request: SnapshotRequest) -> tuple[Spool, Path]:
    client.submit(request)
    claim = client.spool.claim()
    assert claim is not None
    return client.spool, client.spool.attempt_folder(claim.job_id, claim.attempt)


def go(_: float) -> bool:
    return True


@pytest.mark.parametrize("samples", [1, 4])
@pytest.mark.parametrize("mode", ["classic", "scope"])
def test_the_finished_picture_is_the_same_with_and_without(
    client: SnapshotClient,
    scene: Scene,
    inside: Camera,
    mode: str,
    samples: Samples,
) -> None:
    camera = inside.with_size(70, 66)
    requests = []
    for progressive in (False, True):
        if mode == "classic":
            request = client.request_classic(
                scene, camera, samples=samples, progressive=progressive
            )
        else:
            assert scene.surface is not None
            request = client.request_scope(
                scene.surface, camera, samples=samples, progressive=progressive
            )
        client.submit(request)
        requests.append(request)
        # a worker of its own: one that knows the view would not draw it again
        assert run_worker(client.spool.folder, once=True) == 1
    plain, shown = (client.wait(request.id) for request in requests)
    assert shown.radiance().tobytes() == plain.radiance().tobytes()
    assert shown.pixels().tobytes() == plain.pixels().tobytes()
    assert not (plain.folder / FILE_NAME).exists()
    growing = GrowingPicture(client.spool, requests[1].id, 70, 66)
    assert growing.update()
    # Coarse, and yet much nearer to the picture than black is.
    off = np.abs(growing.pixels.astype(float) - shown.pixels())
    assert off.mean() < 0.4 * shown.pixels().mean()


def test_a_part_is_shown_when_all_of_it_is_there(
    client: SnapshotClient, scene: Scene, outside: Camera
) -> None:
    request = client.request_classic(scene, outside.with_size(*SIZE), progressive=True)
    spool, folder = begin(client, request)
    whole = SerialTeam().trace(request, scene, go)
    finisher = Finisher(spool.data)
    expected = finisher.finish(request, scene, whole).pixels
    found, gather = empty_gather(request), empty_gather(request)
    SerialTeam().trace(request, scene, go, found)
    growing = GrowingPicture(spool, request.id, *SIZE)
    with Preview(folder, request, scene, finisher) as preview:
        preview.show_parts(gather)
        assert not growing.update()
        for region in (Region(64, 0, 128, 64), Region(0, 0, 60, 130)):
            gather.add(
                region,
                found.value[region.rows, region.columns].reshape(-1, 4),
                found.depth[region.rows, region.columns].reshape(-1),
            )
        preview.show_parts(gather)
        assert growing.update()
        # The second region ends inside the first part of its row.
        assert np.array_equal(growing.pixels[:64, 64:128], expected[:64, 64:128])
        assert not growing.pixels[:, :64].any()
        preview.show_parts(gather)
        assert not growing.update(), "nothing is shown twice"
    finisher.close()


def test_coarse_pictures_come_first_and_parts_follow(
    client: SnapshotClient,
    scene: Scene,
    inside: Camera,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """With parts at every look, each picture on the way is nearer to the last."""
    monkeypatch.setattr("renderers.snapshots.preview.FIRST_S", -1.0)
    monkeypatch.setattr("renderers.snapshots.preview.SHARE", 1e9)
    monkeypatch.setattr("renderers.art.tracer.SLICE_S", 1e-6)
    assert scene.surface is not None
    camera = inside.with_size(200, 180)
    request = client.request_scope(scene.surface, camera, progressive=True)
    spool, folder = begin(client, request)
    finisher = Finisher(spool.data)
    growing = GrowingPicture(spool, request.id, 200, 180)
    seen = []

    def look(_: float) -> bool:
        if growing.update():
            seen.append(growing.pixels.astype(np.int16))
        return True

    loaded = Scene(
        surface=scene.surface,
        volume=scene.surface.distance,
        transfer_function=scene.transfer_function,
    )
    with Preview(folder, request, loaded, finisher) as preview:
        traced = trace_best(SerialTeam(), request, loaded, look, lambda: False, preview)
    assert isinstance(traced, Traced)
    final = finisher.finish(request, loaded, traced).pixels.astype(np.int16)
    finisher.close()
    off = [float(np.abs(picture - final).mean()) for picture in seen]
    assert len(off) >= 4, "two coarse pictures and some parts"
    assert off == sorted(off, reverse=True)
    assert off[-1] < 0.5 * off[0]
