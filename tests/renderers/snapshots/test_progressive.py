"""A picture that had to be delivered early is the best there was."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from renderers.art import ActiveRayTracer, RenderStoppedError
from renderers.art.regions import Region
from renderers.scene import Camera, GBuffer, Image, Scene
from renderers.snapshots.client import SnapshotClient
from renderers.snapshots.delivery import Finisher
from renderers.snapshots.growing import FILE_NAME, GrowingPicture
from renderers.snapshots.progressive import Preview, coarse_requests, fill, trace_best
from renderers.snapshots.request import ImageSpec, Samples, SnapshotRequest
from renderers.snapshots.spool import Spool
from renderers.snapshots.team import SerialTeam, Traced, empty_gather
from renderers.snapshots.worker import run_worker
from tests.renderers.snapshots.watched_team import WatchedTeam


def asked(client: SnapshotClient, scene: Scene, camera: Camera) -> SnapshotRequest:
    return client.request_classic(scene, camera, progressive=True)


def go(_: float) -> bool:
    return True


class CountingTeam(WatchedTeam):
    """Note the sizes traced; let `deed` happen at each look."""

    def __init__(self, deed: Callable[[int, float], None]) -> None:
        self.sizes: list[int] = []
        super().__init__(
            lambda request: self.sizes.append(request.image.width),
            lambda _, share: deed(len(self.sizes), share),
        )


def test_with_time_enough_the_picture_is_the_same(
    client: SnapshotClient, scene: Scene, outside: Camera
) -> None:
    team = CountingTeam(lambda turn, share: None)
    request = asked(client, scene, outside)
    traced = trace_best(team, request, scene, go, lambda: False)
    assert team.sizes == [13, 50]
    assert traced.drawn is None
    assert isinstance(traced.found, Image)
    expected = ActiveRayTracer(scene).render(outside)
    assert_array_equal(traced.found.rgba, expected.rgba)


@pytest.mark.usefixtures("steady_pace")
def test_what_was_traced_is_kept_and_the_rest_is_coarse(
    client: SnapshotClient, scene: Scene, outside: Camera
) -> None:
    camera = outside.with_size(200, 300)
    late: list[bool] = []
    team = CountingTeam(lambda turn, share: late.append(True) if turn == 3 else None)
    request = asked(client, scene, camera)
    traced = trace_best(team, request, scene, go, lambda: bool(late))
    assert traced.drawn is not None
    # how much depends on where work is first interrupted; some was traced, not all
    assert 0.0 < traced.drawn.mean() < 1.0
    assert isinstance(traced.found, Image)
    whole = ActiveRayTracer(scene).render(camera)
    coarse = ActiveRayTracer(scene).render(camera.with_size(50, 75))
    assert whole.depth_mm is not None
    assert coarse.depth_mm is not None
    assert traced.found.depth_mm is not None
    for found, fine, rough in (
        (traced.found.rgba, whole.rgba, coarse.rgba),
        (traced.found.depth_mm, whole.depth_mm, coarse.depth_mm),
    ):
        assert_array_equal(found[traced.drawn], fine[traced.drawn])
        spread = np.repeat(np.repeat(rough, 4, axis=0), 4, axis=1)
        assert_array_equal(found[~traced.drawn], spread[~traced.drawn])


@pytest.mark.usefixtures("steady_pace")
def test_a_coarse_picture_that_is_cut_short_is_what_there_is(
    client: SnapshotClient, scene: Scene, outside: Camera
) -> None:
    late: list[bool] = []
    team = CountingTeam(lambda turn, share: late.append(True))
    request = asked(client, scene, outside.with_size(500, 430))
    traced = trace_best(team, request, scene, go, lambda: bool(late))
    assert traced.drawn is not None
    assert traced.drawn.mean() < 1
    assert traced.found.size == (430, 500)


def test_who_is_told_at_once_that_it_is_enough_gets_a_coarse_picture(
    client: SnapshotClient, scene: Scene, outside: Camera
) -> None:
    """Never an empty one: a small picture is finished, a large one coarsely."""
    for size in (28, 200):
        camera = outside.with_size(size, size)
        request = asked(client, scene, camera)
        traced = trace_best(CountingTeam(_quiet), request, scene, go, lambda: True)
        assert isinstance(traced.found, Image)
        whole = ActiveRayTracer(scene).render(camera)
        if size == 28:
            assert traced.drawn is None
            assert_array_equal(traced.found.rgba, whole.rgba)
            continue
        assert traced.drawn is not None
        assert traced.coarse == 16
        rest = ~traced.drawn
        rough = ActiveRayTracer(scene).render(camera.with_size(13, 13))
        expected = fill(whole, traced.drawn, rough)
        assert isinstance(expected, Image)
        assert_array_equal(traced.found.rgba, expected.rgba)
        assert traced.found.rgba[rest].any()
        assert traced.counters, "what was traced is counted"


def _quiet(turn: int, share: float) -> None:
    pass


def test_who_gives_up_gets_nothing(
    client: SnapshotClient, scene: Scene, outside: Camera
) -> None:
    team = CountingTeam(lambda turn, share: None)
    request = asked(client, scene, outside)
    with pytest.raises(RenderStoppedError):
        trace_best(team, request, scene, lambda share: False, lambda: False)
    assert team.sizes == [13], "the coarse picture was given up, too"


def test_small_pictures_and_others_have_no_coarse_one(
    client: SnapshotClient, scene: Scene, outside: Camera
) -> None:
    small = asked(client, scene, outside.with_size(28, 40))
    assert coarse_requests(small) == []
    four = client.request_classic(
        scene, outside.with_size(28, 40), samples=4, progressive=True
    )
    assert [r.image for r in coarse_requests(four)] == [ImageSpec(14, 20, 1)]
    large = asked(client, scene, outside.with_size(150, 130))
    sizes = [ImageSpec(10, 9, 1), ImageSpec(38, 33, 1)]
    assert [r.image for r in coarse_requests(large)] == sizes
    team = CountingTeam(lambda turn, share: None)
    plain = client.request_classic(scene, outside)
    trace_best(team, plain, scene, go, lambda: False)
    assert team.sizes == [50]


@pytest.mark.parametrize("size", [(50, 43), (43, 50), (37, 37), (101, 8)])
def test_coarse_pixels_lie_where_the_fine_ones_do(
    size: tuple[int, int], outside: Camera
) -> None:
    """A coarse picture of where its rays go differs from the fine by half a pixel."""
    width, height = size
    fine, rough = (
        GBuffer.empty(h, w)
        for w, h in ((width, height), (-(-width // 4), -(-height // 4)))
    )
    for buffer in (fine, rough):
        h, w = buffer.size
        table = outside.with_size(w, h).lens_table()
        buffer.normal[:] = table / table[..., 2:]
    nothing = np.zeros((height, width), bool)
    found = fill(fine, nothing, rough)
    assert isinstance(found, GBuffer)
    off = np.abs(found.normal - fine.normal)[..., :2]
    pixel = 2 * np.tan(outside.extent) / min(rough.size)
    # beyond the coarse picture's own edge its outermost pixels stand
    assert np.percentile(off, 90) <= 0.51 * pixel
    assert off.max() <= 1.01 * pixel


SIZE = (150, 130)


def begin(client: SnapshotClient, request: SnapshotRequest) -> tuple[Spool, Path]:
    client.submit(request)
    claim = client.spool.claim()
    assert claim is not None
    return client.spool, client.spool.attempt_folder(claim.job_id, claim.attempt)


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


def test_what_is_there_is_shown_as_it_will_be(
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
    preview = Preview(folder, request, scene, finisher)
    preview.show_gathered(gather)
    assert not growing.update()
    region = Region(64, 0, 128, 64)
    gather.add(
        region,
        found.value[region.rows, region.columns].reshape(-1, 4),
        found.depth[region.rows, region.columns].reshape(-1),
    )
    preview.show_gathered(gather)
    assert growing.update()
    assert np.array_equal(growing.pixels[gather.done], expected[gather.done])
    assert not growing.pixels[~gather.done].any()
    preview.show_gathered(gather)
    assert not growing.update(), "nothing is shown twice"
    finisher.close()


def test_coarse_pictures_come_first_and_parts_follow(
    client: SnapshotClient,
    scene: Scene,
    inside: Camera,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """With parts at every look, each picture on the way is nearer to the last."""
    monkeypatch.setattr("renderers.snapshots.progressive.FIRST_S", -1.0)
    monkeypatch.setattr("renderers.snapshots.progressive.SHARE", 1e9)
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
    preview = Preview(folder, request, loaded, finisher)
    traced = trace_best(SerialTeam(), request, loaded, look, lambda: False, preview)
    assert isinstance(traced, Traced)
    final = finisher.finish(request, loaded, traced).pixels.astype(np.int16)
    finisher.close()
    off = [float(np.abs(picture - final).mean()) for picture in seen]
    assert len(off) >= 4, "two coarse pictures and some parts"
    assert off == sorted(off, reverse=True)
    assert off[-1] < 0.5 * off[0]
