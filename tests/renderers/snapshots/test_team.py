from dataclasses import replace
from typing import Any

import msgspec
import numpy as np
import pytest
from numpy.testing import assert_array_equal

from renderers.art import ActiveRayTracer, render_among
from renderers.art.ranks.policy import CellPolicy, Dataflow
from renderers.scene import Camera, Distortion, Image, Mesh, Projection, Scene
from renderers.scene.composition import solids_seen
from renderers.scene.mesh import PlacedMesh
from renderers.shading import downsample_radiance
from renderers.snapshots.client import (
    Snapshot,
    SnapshotClient,
    SnapshotError,
)
from renderers.snapshots.delivery import Attempt
from renderers.snapshots.growing import GrowingPicture
from renderers.snapshots.refinement import coarse_requests, fill, trace_best
from renderers.snapshots.request import (
    QualityName,
    RotationSpec,
    Samples,
    SnapshotRequest,
    to_deflection,
)
from renderers.snapshots.scene_loader import load_tools
from renderers.snapshots.team import SerialTeam, ending_rays
from renderers.snapshots.worker import run_worker
from tests.renderers.snapshots.threaded_end import threaded_team
from tests.renderers.snapshots.watched_team import WatchedTeam
from tests.tools import board, rod

POLICY = CellPolicy(5, Dataflow.STATIC)


TURN = RotationSpec((2.0, 14.0, 16.0), 6.0, (1.0, 0.0, 0.5), 40.0)


@pytest.fixture(scope="module")
def tools(scene: Scene) -> list[PlacedMesh]:
    """Two rods that come out of the tissue, one of them all through it."""
    centre = scene.volume.center_mm
    return [
        rod(centre, centre + np.array([15.0, -20, 12])),
        rod(centre + np.array([-4.0, -16, -6]), centre + np.array([4.0, 16, 3]), 1.0),
    ]


def drawn(client: SnapshotClient, request: SnapshotRequest, **how: Any) -> Snapshot:
    client.submit(request)
    assert run_worker(client.spool.folder, once=True, **how) == 1
    return client.wait(request.id)


def among(
    scene: Scene, camera: Camera, tools: list[PlacedMesh], **how: Any
) -> tuple[Any, Any]:
    image = render_among(
        ActiveRayTracer(scene, threads=1, **how), camera, solids_seen(camera, tools)
    )
    return image.rgba, image.depth_mm


@pytest.mark.parametrize(
    ("lens", "quality", "samples", "deflectors"),
    [
        ("perspective", "preview", 1, ()),
        ("distorted", "snapshot", 4, ()),
        ("orthographic", "snapshot", 1, ()),
        ("equidistant", "final", 4, (TURN,)),
        ("perspective", "reference", 1, ()),
    ],
)
def test_a_request_gives_the_bits_of_render_among(
    client: SnapshotClient,
    scene: Scene,
    outside: Camera,
    tools: list[PlacedMesh],
    lens: str,
    quality: QualityName,
    samples: Samples,
    deflectors: tuple[RotationSpec, ...],
) -> None:
    """Of each ray, where there are four to a pixel."""
    camera = outside
    if lens == "distorted":
        camera = replace(outside, distortion=Distortion(-0.2, 0.03))
    elif lens != "perspective":
        extent = 9.0 if lens == "orthographic" else outside.extent
        law = Projection[lens.upper()]
        camera = replace(outside, extent=extent, projection=law)
    request = client.request_classic(
        scene,
        camera,
        quality=quality,
        samples=samples,
        instruments=tools,
        deflectors=deflectors,
        progressive=quality != "final",
    )
    found = drawn(client, request, threads=1 if quality == "preview" else 2)
    side = 2 if samples == 4 else 1
    fine = camera.with_size(50 * side, 43 * side)
    bent = to_deflection(deflectors)
    rgba, depth = among(scene, fine, tools, quality=quality, deflection=bent)
    if samples == 4:
        rgba = downsample_radiance(rgba)
        depth = depth.reshape(43, 2, 50, 2).min(axis=(1, 3))
    assert_array_equal(found.radiance(), rgba)
    assert_array_equal(found.depth_mm(), depth)
    assert_array_equal(found.coverage(), rgba[..., 3])


@pytest.mark.parametrize("dataflow", list(Dataflow))
def test_ranks_give_the_same_bits_wherever_cells_or_rays_go(
    client: SnapshotClient,
    scene: Scene,
    outside: Camera,
    tools: list[PlacedMesh],
    dataflow: Dataflow,
) -> None:
    """Also when only tools move, or tissue is cut, between two pictures."""
    values = scene.volume.values.copy()
    values[:, :, :9] = -300
    edited = replace(scene, volume=scene.volume.with_values(values, -1000.0))
    asked: list[tuple[Scene, list[PlacedMesh], Samples]] = [
        (scene, tools, 4),
        (scene, tools[:1], 1),
        (scene, [], 1),
        (edited, tools, 1),
    ]
    requests = [
        client.request_classic(
            each, outside, instruments=placed, samples=samples, progressive=True
        )
        for each, placed, samples in asked
    ]
    for request in requests:
        client.submit(request)
    policy = CellPolicy(60 if dataflow is Dataflow.MIGRATING else None, dataflow)
    with threaded_team(client.data, policy) as team:
        assert run_worker(client.spool.folder, once=True, team=team) == len(asked)
    for request, (each, placed, samples) in zip(requests, asked, strict=True):
        found = client.wait(request.id)
        assert found.result.ranks == 3
        size = (100, 86) if samples == 4 else (50, 43)
        rgba, depth = among(each, outside.with_size(*size), placed)
        if samples == 4:
            rgba = downsample_radiance(rgba)
        else:
            assert_array_equal(found.depth_mm(), depth)
        assert_array_equal(found.radiance(), rgba)


def test_what_is_behind_all_tissue_shows_only_through_it(
    client: SnapshotClient, scene: Scene, outside: Camera
) -> None:
    """And not a bit of it behind what lets nothing through."""
    far = [board(outside, 60.0, 16.0)]
    sharp = replace(
        scene.transfer_function, kappa_per_mm=np.array([0.0, 0.0, 0.05, 90.0])
    )
    walled = replace(scene, transfer_function=sharp)
    solids = solids_seen(outside, far)
    radiance = []
    for placed in (far, []):
        request = client.request_classic(walled, outside, instruments=placed)
        # every ray goes on until nothing is left of its light
        whole = msgspec.structs.replace(request, cutoff=0.0)
        radiance.append(drawn(client, whole).radiance())
    found, bare = radiance
    met, opaque = solids.coverage > 0, bare[..., 3] == 1
    assert (met & opaque).sum() > 50 < (met & (bare[..., 3] < 0.5)).sum()
    unchanged = opaque | ~met
    assert_array_equal(found[unchanged], bare[unchanged])
    rest = 1 - bare[met]
    assert_array_equal(found[met, 3], bare[met, 3] + (1 - bare[met, 3]))
    added = found[met, :3] - bare[met, :3]
    # black plastic, .035 at most under so much light
    assert np.all(added >= 0)
    assert np.all(added <= 0.2 * rest[:, 3:] + 1e-7)


@pytest.mark.usefixtures("steady_pace")
def test_stopped_early_it_has_the_tool_in_every_part(
    client: SnapshotClient, scene: Scene, outside: Camera
) -> None:
    """Coarse parts have the tool that coarse rays ended at, done ones their own."""
    camera = outside.with_size(160, 144)
    request = client.request_classic(
        scene, camera, progressive=True, instruments=[board(outside, 27.0, 11.0)]
    )
    loaded = load_tools(client.data, request)
    halfway = []

    def look(asked: SnapshotRequest, share: float) -> None:
        if asked.image.width == 160 and share > 0.5:
            halfway.append(share)

    team = WatchedTeam(looks=look)

    traced = trace_best(
        team, request, scene, Attempt(enough=lambda: bool(halfway)), tools=loaded
    )
    done = traced.drawn
    assert done is not None
    assert 0 < done.mean() < 1
    assert isinstance(traced.found, Image)
    solids = ending_rays(request, loaded)
    assert solids is not None
    assert 0 < (done & (solids.coverage > 0)).sum() < (solids.coverage > 0).sum()
    whole = SerialTeam(1).trace(request, scene, lambda share: True, tools=loaded).found
    coarse = (
        SerialTeam(1)
        .trace(coarse_requests(request)[-1], scene, lambda share: True, tools=loaded)
        .found
    )
    wanted = fill(whole, done, coarse)
    assert isinstance(wanted, Image)
    assert_array_equal(traced.found.rgba, wanted.rgba)
    assert_array_equal(traced.found.depth_mm, wanted.depth_mm)


@pytest.mark.parametrize("samples", [1, 4])
def test_parts_that_are_shown_on_the_way_have_the_tool(
    client: SnapshotClient,
    scene: Scene,
    outside: Camera,
    tools: list[PlacedMesh],
    samples: Samples,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("renderers.snapshots.refinement.FIRST_S", -1.0)
    monkeypatch.setattr("renderers.snapshots.refinement.SHARE", 1e9)
    request = client.request_classic(
        scene, outside, instruments=tools, samples=samples, progressive=True
    )
    drawn(client, request)
    growing = GrowingPicture(client.spool, request.id, 50, 43)
    assert growing.update()
    # the last look was at all of it, at one ray a pixel
    step = 2 if samples == 4 else 1
    rgba, _ = among(scene, outside.with_size(50 * step, 43 * step), tools)
    one = Image(np.ascontiguousarray(rgba[::step, ::step])).to_srgb8()
    off = np.abs(growing.pixels.astype(np.int16) - one)
    # the light of one of four rays is taken where the pixel's middle is
    assert off.max() <= step - 1


def test_what_is_wrong_with_a_tool_is_told_to_the_client(
    client: SnapshotClient, scene: Scene, outside: Camera, tools: list[PlacedMesh]
) -> None:
    request = client.request_classic(scene, outside, instruments=tools)
    with pytest.raises(
        ValueError, match="places 2 instruments that rays end at, and 0"
    ):
        ending_rays(request, ())
    mesh, pose = tools[0]
    gone = msgspec.structs.replace(request.work.instruments[0], faces="0" * 64)
    work = msgspec.structs.replace(request.work, instruments=(gone,))
    lost = msgspec.structs.replace(request, work=work)
    with pytest.raises(SnapshotError, match="there is no data 0000"):
        drawn(client, lost)
    tissue = Mesh(mesh.vertices, mesh.faces, type(mesh.material)(0))
    with pytest.raises(ValueError, match="cannot be made of TISSUE"):
        client.request_classic(scene, outside, instruments=[(tissue, pose)])
    many = client.request_classic(scene, outside, instruments=17 * [tools[0]])
    with pytest.raises(ValueError, match="instruments must be a list of at most 16"):
        client.submit(many)
