"""Cameras in tissue are told from those in air."""

from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pytest

from renderers.scene import AIR_HU, Camera, Projection, Scene
from renderers.snapshots.camera_check import camera_in_tissue
from renderers.snapshots.client import SnapshotClient
from renderers.snapshots.deflector_request import TranslationSpec
from renderers.snapshots.request import SnapshotRequest
from renderers.snapshots.scene_loader import load_scene
from renderers.snapshots.worker import run_worker


@pytest.fixture
def client(tmp_path: Path) -> SnapshotClient:
    return SnapshotClient(tmp_path / "spool")


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
