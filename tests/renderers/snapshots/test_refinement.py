"""Samples where they matter most: the end is the whole picture; the way is told."""

from collections.abc import Callable
from itertools import pairwise
from typing import Any

import msgspec
import numpy as np
import pytest
from numpy.testing import assert_array_equal
from numpy.typing import NDArray

from renderers.art import ActiveRayTracer
from renderers.art.regions import Gather
from renderers.art.tracer import RenderStoppedError
from renderers.scene import Camera, Material, Mesh, Scene
from renderers.snapshots.client import SnapshotClient
from renderers.snapshots.delivery import Finisher, Picture
from renderers.snapshots.growing import FILE_NAME, GrowingPicture
from renderers.snapshots.refinement import Refinement, can_refine, refined
from renderers.snapshots.request import PathTracingSpec, SnapshotRequest
from renderers.snapshots.scene_loader import load_scene
from renderers.snapshots.team import SerialTeam, Tools, Traced
from renderers.snapshots.worker import run_worker


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


def blade(camera: Camera) -> tuple[Mesh, NDArray[np.float64]]:
    """Hold a metal triangle before the lens."""
    corners = np.array([[-0.5, -0.5, 1], [0.5, -0.5, 1], [0, 0.5, 1.0]])
    pose = np.eye(4)
    pose[:3, :3] = camera.frame[1:].T * [-1, 1, 1]
    pose[:3, 3] = camera.eye_mm
    return Mesh(corners, np.array([[0, 1, 2]]), Material.METAL), pose


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
    client: SnapshotClient, request: SnapshotRequest, team: SerialTeam | None = None
) -> Refinement:
    scene = load_scene(client.data, request)
    finisher = Finisher(client.data, 1)
    return Refinement(
        team or SerialTeam(1), finisher, request, scene, lambda share: True
    )


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
    found = refined(begun(client, loose), lambda share: True, lambda: False)
    assert found.complete
    assert found.error is not None
    assert 0 < found.error <= 0.5 * first
    assert 1 < found.samples.mean() < 4
    cut = refined(begun(client, request), lambda share: True, lambda: True)
    assert not cut.complete
    assert cut.samples.max() == 1
    with pytest.raises(RenderStoppedError):
        refined(begun(client, request), lambda share: False, lambda: False)


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


def test_rays_that_nobody_wants_change_no_others(scene: Scene, inside: Camera) -> None:
    tracer = ActiveRayTracer(scene, threads=1)
    camera = inside.with_size(150, 130)
    whole = tracer.gbuffer(camera)
    wanted = np.zeros((130, 150), np.bool_)
    wanted[70:90, 10:40] = True
    wanted[3, ::7] = True
    limit = np.where(wanted, np.inf, 0).astype(np.float32)
    found = tracer.gbuffer(camera, limit_mm=limit)
    assert np.array_equal(found.depth_mm[wanted], whole.depth_mm[wanted])
    assert np.array_equal(found.normal[wanted], whole.normal[wanted])
    assert not np.isfinite(found.depth_mm[~wanted]).any()
    none = tracer.gbuffer(camera, limit_mm=np.zeros_like(limit))
    assert not none.coverage.any()
