from dataclasses import replace

import msgspec
import numpy as np
import pytest

from renderers.scene import AIR_HU, Camera, Material, Mesh, Projection, Scene
from renderers.snapshots.client import SnapshotClient
from renderers.snapshots.request import ScopeWork, SnapshotRequest, TranslationSpec
from renderers.snapshots.scene_loader import (
    camera_in_tissue,
    family_key,
    instrument_meshes,
    load_scene,
    scene_key,
)
from renderers.snapshots.worker import run_worker

TRIANGLE = Mesh(
    np.array([[-1.0, -1, 0], [1, -1, 0], [0, 1, 0]]),
    np.array([[0, 1, 2]]),
    Material.DARK_PLASTIC,
)


def test_a_scene_survives_its_request(
    client: SnapshotClient, scene: Scene, outside: Camera, inside: Camera
) -> None:
    request = client.request_classic(scene, outside)
    found = load_scene(client.data, request)
    assert np.array_equal(found.volume.values, scene.volume.values)
    for name in ("spacing_mm", "origin_mm", "direction"):
        assert np.array_equal(getattr(found.volume, name), getattr(scene.volume, name))
    transfer = found.transfer_function
    assert np.array_equal(transfer.nodes, scene.transfer_function.nodes)
    assert np.array_equal(transfer.kappa_per_mm, scene.transfer_function.kappa_per_mm)
    assert found.material == scene.material
    for light, expected in zip(found.lights, scene.lights, strict=True):
        assert light.vector == pytest.approx(expected.vector, abs=1e-15)
        assert light.is_local == expected.is_local
    assert request.to_camera().frame == pytest.approx(outside.frame, abs=0)
    assert scene.surface is not None
    scope = load_scene(client.data, client.request_scope(scene.surface, inside))
    assert scope.surface is not None
    assert np.array_equal(scope.surface.distance.values, scene.surface.distance.values)


def test_a_volume_of_another_type_or_shape_is_refused(
    client: SnapshotClient, scene: Scene, inside: Camera
) -> None:
    assert scene.surface is not None
    request = client.request_scope(scene.surface, inside)
    flat = client.put(np.zeros((3, 3), np.uint8))
    for digest, reason in (
        (client.put(scene.volume.values), "expected uint8"),
        (flat, "three axes"),
    ):
        work = msgspec.structs.replace(request.work, blood=digest)
        with pytest.raises(ValueError, match=reason):
            load_scene(client.data, msgspec.structs.replace(request, work=work))


def test_a_key_tells_scenes_apart_but_not_views(
    client: SnapshotClient, scene: Scene, outside: Camera
) -> None:
    one = client.request_classic(scene, outside)
    other_view = client.request_classic(scene, outside.with_size(20, 20))
    finer = client.request_classic(scene, outside, quality="final")
    assert scene_key(one) == scene_key(other_view)
    assert scene_key(one) != scene_key(finer)
    assert scene_key(one) != scene_key(msgspec.structs.replace(one, cutoff=0.25))
    armed = client.request_classic(scene, outside, instruments=[(TRIANGLE, np.eye(4))])
    assert scene_key(one) == scene_key(armed)
    assert family_key(one) == family_key(armed)
    sampled = msgspec.structs.replace(one, classification="post")
    assert scene_key(one) != scene_key(sampled)
    assert family_key(one) != family_key(sampled)


def test_instruments_stand_where_their_pose_says(
    client: SnapshotClient, scene: Scene
) -> None:
    assert scene.surface is not None
    camera = Camera.looking_at([0, -10, 0], [0, 0, 0], size=(32, 32))
    pose = np.array([[1.0, 0, 0, 0], [0, 0, -1, -4], [0, 1, 0, 0], [0, 0, 0, 1]])
    request = client.request_scope(
        scene.surface, camera, instruments=[(TRIANGLE, pose)]
    )
    work = request.work
    assert isinstance(work, ScopeWork)
    ((mesh, placed),) = instrument_meshes(client.data, work.instruments)
    found = mesh.gbuffer(camera, placed)
    assert found.depth_mm.min() == pytest.approx(6, abs=0.01)
    assert set(np.unique(found.material)) == {0, Material.DARK_PLASTIC}
    mirrored = pose.copy()
    mirrored[:3, 0] *= -1
    bent = client.request_scope(
        scene.surface, camera, instruments=[(TRIANGLE, mirrored)]
    )
    assert isinstance(bent.work, ScopeWork)
    with pytest.raises(ValueError, match="pose must be rigid"):
        instrument_meshes(client.data, bent.work.instruments)


def test_what_casts_a_tools_shadow_goes_with_it(
    client: SnapshotClient, scene: Scene
) -> None:
    assert scene.surface is not None
    camera = Camera.looking_at([0, -10, 0], [0, 0, 0], size=(32, 32))
    rods = np.array([[0.0, 0, 0, 0, 0, 9, 0.5]])
    shaded = Mesh(TRIANGLE.vertices, TRIANGLE.faces, TRIANGLE.material, rods)
    both = [(shaded, np.eye(4)), (TRIANGLE, np.eye(4))]
    request = client.request_scope(scene.surface, camera, instruments=both)
    work = request.work
    assert isinstance(work, ScopeWork)
    (first, _), (second, _) = instrument_meshes(client.data, work.instruments)
    assert first.capsules is not None
    np.testing.assert_array_equal(first.capsules, rods)
    assert second.capsules is None
    # a file from elsewhere: triangles where rods should be
    wrong = msgspec.structs.replace(
        work.instruments[0], capsules=work.instruments[0].vertices
    )
    with pytest.raises(ValueError, match=r"capsules must be \(k, 7\), got"):
        instrument_meshes(client.data, (wrong,))


def test_an_edited_volume_is_of_the_same_family(
    client: SnapshotClient, scene: Scene, outside: Camera
) -> None:
    edited = replace(scene, volume=scene.volume.with_values(scene.volume.values + 1, 0))
    moved = replace(scene, volume=replace(scene.volume, origin_mm=np.ones(3)))
    asked, after, other = (
        client.request_classic(s, outside) for s in (scene, edited, moved)
    )
    assert family_key(asked) == family_key(after) != family_key(other)
    assert scene_key(asked) != scene_key(after)


def stands_in_tissue(client: SnapshotClient, request: SnapshotRequest) -> bool:
    return camera_in_tissue(request, load_scene(client.data, request))


def at(
    camera: Camera, place: np.ndarray[tuple[int, ...], np.dtype[np.float64]]
) -> Camera:
    return camera.moved(np.vstack([place, camera.frame[1:]]))


def test_in_mode_scope_the_air_distance_tells(
    client: SnapshotClient, scene: Scene, inside: Camera
) -> None:
    assert scene.surface is not None
    distance = scene.surface.distance
    densest = np.unravel_index(int(distance.values.argmax()), distance.shape)
    wall = distance.world_from_voxel @ [*densest[::-1], 1.0]
    for place, expected in (
        (inside.eye_mm, False),
        (wall[:3], True),
        (wall[:3] + 1e3, False),
    ):
        request = client.request_scope(scene.surface, at(inside, place), gain=1.0)
        assert stands_in_tissue(client, request) is expected


def test_in_mode_classic_the_transfer_function_tells(
    client: SnapshotClient, scene: Scene, outside: Camera
) -> None:
    volume = scene.volume
    shown = scene.transfer_function.evaluate(volume.values)[1] > 0
    for here, expected in ((shown, True), (~shown, False)):
        voxel = np.argwhere(here)[0][::-1]
        place = (volume.world_from_voxel @ [*voxel, 1.0])[:3]
        request = client.request_classic(scene, at(outside, place))
        assert stands_in_tissue(client, request) is expected
        flat = replace(at(outside, place), projection=Projection.ORTHOGRAPHIC)
        request = client.request_classic(scene, flat)
        assert stands_in_tissue(client, request) is False
    assert volume.background == AIR_HU
    assert stands_in_tissue(client, client.request_classic(scene, outside)) is False


def test_tissue_counts_where_it_is_seen(
    client: SnapshotClient, scene: Scene, inside: Camera
) -> None:
    """Pulled over the eye, it is around it; the result says so."""
    assert scene.surface is not None
    distance = scene.surface.distance
    eye = inside.eye_mm
    steps = np.linspace(0, 6, 61)
    way = inside.frame[3]
    values = distance.sample(eye + steps[:, None] * way)
    away = float(steps[np.argmax(values > 0.4)])
    radius = 2.2 * away
    pull = TranslationSpec(
        center_mm=tuple(eye.tolist()),
        radius_mm=radius,
        shift_mm=tuple((-away * way).tolist()),
    )
    request = client.request_scope(scene.surface, inside.with_size(16, 16), gain=1.0)
    bent = msgspec.structs.replace(request, deflectors=(pull,))
    assert not stands_in_tissue(client, request)
    assert stands_in_tissue(client, bent)
    job = client.submit(bent)
    run_worker(client.spool.folder, once=True)
    result = client.wait(job).result
    assert result.camera_in_tissue
    assert result.step_voxels == 0.5
