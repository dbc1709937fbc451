"""A picture that had to be delivered early is the best there was."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from renderers.art import ActiveRayTracer, RenderStoppedError
from renderers.scene import Camera, Image, Scene
from renderers.snapshots.client import SnapshotClient
from renderers.snapshots.filling import fill
from renderers.snapshots.progressive import coarse_requests, trace_best
from renderers.snapshots.request import ImageSpec, SnapshotRequest
from tests.renderers.snapshots.watched_team import WatchedTeam


@pytest.fixture
def client(tmp_path: Any) -> SnapshotClient:
    return SnapshotClient(tmp_path / "spool")


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
