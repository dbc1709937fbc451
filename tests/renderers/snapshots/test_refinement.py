"""The best picture there is, and how far off it says that it is."""

from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_array_equal
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from renderers.art import ActiveRayTracer
from renderers.art.regions import Gather, Region
from renderers.art.tracer import RenderStoppedError
from renderers.scene import Camera, GBuffer, Image, Scene
from renderers.snapshots.client import SnapshotClient
from renderers.snapshots.delivery import Attempt, Finisher, Picture
from renderers.snapshots.growing import FILE_NAME, GrowingPicture
from renderers.snapshots.refinement import (
    Preview,
    Refinement,
    can_refine,
    coarse_requests,
    fill,
    stopped_error,
    trace_best,
)
from renderers.snapshots.request import (
    ImageSpec,
    PathTracingSpec,
    Samples,
    SnapshotRequest,
)
from renderers.snapshots.scene_loader import load_scene
from renderers.snapshots.spool import Spool
from renderers.snapshots.team import SerialTeam, Tools, Traced, empty_gather
from renderers.snapshots.worker import run_worker
from tests.renderers.snapshots.bare_requests import blade
from tests.renderers.snapshots.watched_team import WatchedTeam


def at_any_moment(
    client: SnapshotClient, scene: Scene, camera: Camera
) -> SnapshotRequest:
    return client.request_classic(scene, camera, progressive=True)


class CountingTeam(WatchedTeam):
    """Note the sizes traced; let `deed` happen at each look."""

    def __init__(
        self, deed: Callable[[int, float], None] = lambda turn, share: None
    ) -> None:
        self.sizes: list[int] = []
        super().__init__(
            lambda request: self.sizes.append(request.image.width),
            lambda _, share: deed(len(self.sizes), share),
        )


@pytest.mark.usefixtures("steady_pace")
def test_what_was_traced_is_kept_and_the_rest_is_coarse(
    client: SnapshotClient, scene: Scene, outside: Camera
) -> None:
    camera = outside.with_size(200, 300)
    late: list[bool] = []
    team = CountingTeam(lambda turn, share: late.append(True) if turn == 3 else None)
    request = at_any_moment(client, scene, camera)
    traced = trace_best(team, request, scene, Attempt(enough=lambda: bool(late)))
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
    request = at_any_moment(client, scene, outside.with_size(500, 430))
    traced = trace_best(team, request, scene, Attempt(enough=lambda: bool(late)))
    assert traced.drawn is not None
    assert traced.drawn.mean() < 1
    assert traced.found.size == (430, 500)


def test_who_is_told_at_once_that_it_is_enough_gets_a_coarse_picture(
    client: SnapshotClient, scene: Scene, outside: Camera
) -> None:
    """Never an empty one: a small picture is finished, a large one coarsely."""
    for size in (28, 200):
        camera = outside.with_size(size, size)
        request = at_any_moment(client, scene, camera)
        traced = trace_best(
            CountingTeam(), request, scene, Attempt(enough=lambda: True)
        )
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


def test_who_gives_up_gets_nothing(
    client: SnapshotClient, scene: Scene, outside: Camera
) -> None:
    team = CountingTeam()
    request = at_any_moment(client, scene, outside)
    with pytest.raises(RenderStoppedError):
        trace_best(team, request, scene, Attempt(lambda share: False))
    assert team.sizes == [13], "the coarse picture was given up, too"


def test_small_pictures_and_others_have_no_coarse_one(
    client: SnapshotClient, scene: Scene, outside: Camera
) -> None:
    small = at_any_moment(client, scene, outside.with_size(28, 40))
    assert coarse_requests(small) == []
    four = client.request_classic(
        scene, outside.with_size(28, 40), samples=4, progressive=True
    )
    assert [r.image for r in coarse_requests(four)] == [ImageSpec(14, 20, 1)]
    large = at_any_moment(client, scene, outside.with_size(150, 130))
    sizes = [ImageSpec(10, 9, 1), ImageSpec(38, 33, 1)]
    assert [r.image for r in coarse_requests(large)] == sizes
    team = CountingTeam()
    plain = client.request_classic(scene, outside)
    trace_best(team, plain, scene, Attempt())
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
    whole = SerialTeam().trace(request, scene, lambda share: True)
    finisher = Finisher(spool.data)
    expected = finisher.finish(request, scene, whole).pixels
    found, gather = empty_gather(request), empty_gather(request)
    SerialTeam().trace(request, scene, lambda share: True, found)
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
    monkeypatch.setattr("renderers.snapshots.refinement.FIRST_S", -1.0)
    monkeypatch.setattr("renderers.snapshots.refinement.SHARE", 1e9)
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
    traced = trace_best(SerialTeam(), request, loaded, Attempt(look), preview)
    assert isinstance(traced, Traced)
    final = finisher.finish(request, loaded, traced).pixels.astype(np.int16)
    finisher.close()
    off = [float(np.abs(picture - final).mean()) for picture in seen]
    assert len(off) >= 4, "two coarse pictures and some parts"
    assert off == sorted(off, reverse=True)
    assert off[-1] < 0.5 * off[0]


class WholeTeam(SerialTeam):
    """Trace every ray whatever is wanted, as ranks do."""

    traces_parts = False

    def trace(
        self,
        request: SnapshotRequest,
        scene: Scene,
        progress: Callable[[float], bool],
        gather: Gather | None = None,
        tools: Tools = (),
    ) -> Traced:
        return super().trace(request, scene, progress)


def asked(
    client: SnapshotClient, scene: Scene, camera: Camera, **more: Any
) -> SnapshotRequest:
    assert scene.surface is not None
    request = client.request_scope(scene.surface, camera, gain=1.0, **more)
    return msgspec.structs.replace(request, tolerance=0.0)


def whole(client: SnapshotClient, request: SnapshotRequest) -> Picture:
    finisher = Finisher(client.data, 1)
    scene = load_scene(client.data, request)
    traced = SerialTeam(1).trace(request, scene, lambda share: True)
    picture = finisher.finish(request, scene, traced)
    finisher.close()
    return picture


def begun(
    client: SnapshotClient,
    request: SnapshotRequest,
    team: SerialTeam | None = None,
    go_on: Callable[[float], bool] = lambda share: True,
) -> Refinement:
    scene = load_scene(client.data, request)
    finisher = Finisher(client.data, 1)
    return Refinement(team or SerialTeam(1), finisher, request, scene, go_on)


@pytest.mark.parametrize("size", [(64, 48), (43, 50)])
@pytest.mark.parametrize("with_tool", [False, True])
@pytest.mark.parametrize("team", [SerialTeam, WholeTeam])
def test_when_all_have_all_samples_it_is_the_very_picture(
    client: SnapshotClient,
    scene: Scene,
    inside: Camera,
    size: tuple[int, int],
    with_tool: bool,
    team: type[SerialTeam],
) -> None:
    """And before, each refined pixel has its final radiance, to the bit."""
    camera = inside.with_size(*size)
    tools = [blade(camera)] if with_tool else []
    request = asked(client, scene, camera, instruments=tools)
    expected = whole(client, request)
    refinement = begun(client, request, team(1))
    while refinement.share < 1:
        refinement.step(7)
        so_far = refinement.picture()
        here = refinement.refined
        assert_array_equal(so_far.radiance[here], expected.radiance[here])
        assert_array_equal(so_far.depth_mm[here], expected.depth_mm[here])
        assert_array_equal(so_far.samples, np.where(here, 4, 1))
    found = refinement.picture()
    assert_array_equal(found.pixels, expected.pixels)
    assert_array_equal(found.radiance, expected.radiance)
    assert_array_equal(found.depth_mm, expected.depth_mm)
    assert_array_equal(found.coverage, expected.coverage)
    assert found.complete
    assert found.error == 0


def codes(radiance: NDArray[np.float32]) -> NDArray[np.float64]:
    light = np.clip(radiance.astype(np.float64), 0, 1)
    return np.asarray(255 * light ** (1 / 2.2))


def test_the_worst_go_first_and_the_error_told_is_the_error_there_is(
    client: SnapshotClient, scene: Scene, inside: Camera
) -> None:
    camera = inside.with_size(128, 128)
    request = asked(client, scene, camera)
    expected = whole(client, request)
    # within the field's stop: nothing beyond it is shown
    place = (np.arange(128) - 63.5) / 64
    seen = (expected.coverage > 0) & (np.hypot(place, place[:, None]) <= 1)
    refinement = begun(client, request)

    def off() -> float:
        apart = codes(refinement.picture().radiance) - codes(expected.radiance)
        return float(np.sqrt((apart[seen] ** 2).mean()))

    first = off()
    spent = [first]
    told = [refinement.error]
    while refinement.share < 0.5:
        refinement.step()
        spent.append(off())
        told.append(refinement.error)
    assert all(b <= a for a, b in pairwise(spent))
    # in raster order half of the tiles would leave about half of the squared error
    assert spent[-1] ** 2 < 0.25 * first**2
    # an estimate: of the right size, in a scene rougher than a nose
    for said, there in zip(told, spent, strict=True):
        assert 0.2 * there <= said <= 5 * there


def test_it_stops_at_the_tolerance_when_told_and_never_for_nobody(
    client: SnapshotClient, scene: Scene, inside: Camera
) -> None:
    request = asked(client, scene, inside.with_size(96, 96))
    first = begun(client, request).error
    loose = msgspec.structs.replace(request, tolerance=0.5 * first)
    found = begun(client, loose).run(lambda: False)
    assert found.complete
    assert found.error is not None
    assert 0 < found.error <= 0.5 * first
    assert 1 < found.samples.mean() < 4
    cut = begun(client, request).run(lambda: True)
    assert not cut.complete
    assert cut.samples.max() == 1
    with pytest.raises(RenderStoppedError):
        begun(client, request, go_on=lambda share: share < 0.1).run(lambda: False)


def test_the_service_refines_shows_and_says_so(
    client: SnapshotClient, scene: Scene, inside: Camera
) -> None:
    camera = inside.with_size(64, 64)
    request = asked(client, scene, camera, progressive=True)
    job = client.submit(request)
    run_worker(client.spool.folder, once=True)
    found = client.wait(job)
    expected = whole(client, request)
    assert_array_equal(found.pixels(), expected.pixels)
    assert found.result.error == 0
    assert found.result.complete
    assert found.result.traced == 1
    assert (found.folder / FILE_NAME).exists()
    growing = GrowingPicture(client.spool, request.id, 64, 64)
    assert growing.update()
    loose = msgspec.structs.replace(request, id="1" * 32, tolerance=255.0)
    client.submit(loose)
    run_worker(client.spool.folder, once=True)
    rough = client.wait(loose.id)
    assert rough.result.complete
    assert rough.result.traced == 0.25
    assert_array_equal(growing.pixels, rough.pixels())


def test_only_pictures_of_four_samples_by_quick_light_are_refined(
    client: SnapshotClient, scene: Scene, inside: Camera
) -> None:
    assert scene.surface is not None
    request = asked(client, scene, inside)
    assert can_refine(request)
    assert not can_refine(msgspec.structs.replace(request, tolerance=None))
    single = client.request_scope(scene.surface, inside, samples=1)
    assert not can_refine(msgspec.structs.replace(single, tolerance=0.0))
    truth = client.request_scope(scene.surface, inside, path_tracing=PathTracingSpec())
    assert not can_refine(msgspec.structs.replace(truth, tolerance=0.0))
    classic = client.request_classic(scene, inside, samples=4)
    assert not can_refine(msgspec.structs.replace(classic, tolerance=0.0))


EDGE = 96


def stepped(picture: NDArray[np.float32], block: int) -> NDArray[np.float32]:
    """Show each block's middle in all of it, as nearest coarse rays do."""
    half = block // 2
    middles = [
        picture[half - r :: block, half - c :: block] for r in (0, 1) for c in (0, 1)
    ]
    middle = np.mean(middles, axis=0)
    wide = np.repeat(np.repeat(middle, block, axis=0), block, axis=1)
    return np.asarray(wide, dtype=np.float32)


def wavy(seed: int, length_px: float) -> NDArray[np.float32]:
    noise = np.random.default_rng(seed).normal(size=(EDGE, EDGE, 3))
    smooth = gaussian_filter(noise, (length_px, length_px, 0), mode="wrap")
    return np.asarray(40 * smooth / smooth.std() + 120, dtype=np.float32)


ALL = np.ones((EDGE, EDGE), np.bool_)


@pytest.mark.parametrize("block", [2, 4, 8, 16])
def test_a_ramp_is_off_by_its_slope(block: int) -> None:
    ramp = np.zeros((EDGE, EDGE, 3), np.float32)
    ramp += 0.7 * np.arange(EDGE, dtype=np.float32)[:, None, None]
    shown = stepped(ramp, block)
    true = np.sqrt(((shown - ramp) ** 2).mean())
    found = stopped_error(shown, ~ALL, block, ALL)
    # a pixel is no point: sqrt(1 - 1 / block^2)
    assert found == pytest.approx(true / np.sqrt(1 - block**-2), rel=1e-5)


def test_what_is_whole_has_no_error_and_what_does_not_count_none_either() -> None:
    picture = wavy(1, 6)
    assert stopped_error(picture, ALL, 8, ALL) == 0
    upper = ALL.copy()
    upper[EDGE // 2 :] = False
    assert stopped_error(picture, upper, 8, upper) == 0
    assert stopped_error(picture, ~upper, 8, upper) > 0


@given(
    st.integers(0, 2**31),
    st.sampled_from([2, 4, 8, 16]),
    st.floats(3, 20),
    st.integers(0, EDGE - 8),
)
def test_the_estimate_is_near_the_truth(
    seed: int, block: int, length_px: float, rows: int
) -> None:
    """From above, as far as rows; with and without traced blocks to learn from.

    Where what is seen changes within a block its middle says little.
    """
    length_px = max(length_px, 0.75 * block)
    fine = wavy(seed, length_px)
    drawn = np.zeros((EDGE, EDGE), np.bool_)
    drawn[:rows] = True
    shown = np.where(drawn[..., None], fine, stepped(fine, block))
    true = np.sqrt(((shown - fine) ** 2).mean())
    found = stopped_error(shown, drawn, block, ALL)
    assert true / 2.5 < found < 2.5 * true


def test_sharp_detail_that_was_traced_is_expected_elsewhere_too() -> None:
    """Steps between blocks do not show it; the traced half does."""
    fine = wavy(3, 20)
    fine[::3, ::3] += 60
    drawn = np.zeros((EDGE, EDGE), np.bool_)
    drawn[: EDGE // 2] = True
    shown = np.where(drawn[..., None], fine, stepped(wavy(3, 20), 4))
    true = np.sqrt(((shown - fine) ** 2).mean())
    learnt = stopped_error(shown, drawn, 4, ALL)
    unlearnt = stopped_error(shown, ~ALL, 4, ALL) / np.sqrt(2)
    assert abs(learnt - true) < abs(unlearnt - true)
    assert true / 3 < learnt < 3 * true


def test_a_picture_smaller_than_a_block_is_one() -> None:
    picture = np.full((5, 7, 3), 9, np.float32)
    all_of_it = np.ones((5, 7), np.bool_)
    assert stopped_error(picture, ~all_of_it, 16, all_of_it) == 0
