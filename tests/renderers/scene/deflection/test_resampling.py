import numpy as np
import pytest

from renderers.scene import AirSurface, Scene, TransferFunction, Volume
from renderers.scene.deflection import (
    Cut,
    Deflection,
    Rotation,
    Scaling,
    Translation,
    deflected_distance,
    deflected_scene,
    deflected_volume,
)

PUSH = Deflection((Translation(np.array([6.0, 0, 0]), 4.0, np.array([-1.5, 0, 0])),))


@pytest.fixture(scope="module")
def hollow() -> Volume:
    """Air inside a sphere of 6 mm around the origin, 0.5 mm voxels."""
    k, j, i = np.indices((37, 37, 37)) * 0.5 - 9.0
    d = np.sqrt(i * i + j * j + k * k) - 6.0
    return Volume(
        d.astype(np.float32), np.full(3, 0.5), np.full(3, -9.0), background=6.0
    )


def test_grid_points_outside_the_balls_keep_their_bits(hollow: Volume) -> None:
    found = deflected_volume(hollow, PUSH)
    matrix = hollow.world_from_voxel
    voxels = np.argwhere(np.ones(hollow.shape, bool))
    stays = ~PUSH.moves(voxels[:, ::-1] @ matrix[:3, :3].T + matrix[:3, 3])
    stays = stays.reshape(hollow.shape)
    assert np.array_equal(found.values[stays], hollow.values[stays])
    assert np.any(found.values[~stays] != hollow.values[~stays])


def test_the_deformed_surface_is_where_its_points_are_pushed(hollow: Volume) -> None:
    found = deflected_distance(hollow, PUSH)
    way = np.random.default_rng(2).normal(size=(400, 3))
    wall = 6 * way / np.linalg.norm(way, axis=1, keepdims=True)
    moved = PUSH.push_forward(wall)
    assert np.linalg.norm(moved - wall, axis=1).max() > 1.0
    # two trilinear interpolations of 0.5 mm
    assert np.abs(found.sample(moved)).max() < 0.12
    assert np.abs(found.sample(moved)).mean() < 0.02


@pytest.mark.parametrize("factor", [0.5, 2.0])
def test_near_the_surface_deformed_distances_are_not_longer_than_distances(
    hollow: Volume, factor: float
) -> None:
    deflection = Deflection((Scaling(np.array([5.0, 0, 0]), 5.0, factor),))
    found = deflected_distance(hollow, deflection).values.astype(float)
    slope = np.linalg.norm(np.gradient(found, 0.5), axis=0)
    assert slope[np.abs(found) < 0.4].max() < 1.15
    assert slope[np.abs(found) < 0.4].mean() > 0.7


def test_a_gap_is_air_and_its_walls_are_where_it_opens(hollow: Volume) -> None:
    cut = Cut(np.array([7.0, 0, 0]), 3.0, np.array([0.0, 1.0, 0.0]), 1.0)
    deflection = Deflection((cut,))
    found = deflected_distance(hollow, deflection)
    assert hollow.sample(np.array([[7.0, 0, 0]]))[0] > 0.9
    assert found.sample(np.array([[7.0, 0, 0]]))[0] < -0.9
    # the face is where h = 1.0 w(h)
    assert found.sample(np.array([[7.0, 0.847, 0]]))[0] == pytest.approx(0, abs=0.05)


def test_a_whole_scene_is_deformed(hollow: Volume) -> None:
    hu = hollow.with_values((hollow.values * 100).astype(np.int16), -1000.0)
    codes = (np.indices(hollow.shape)[2] * 7).astype(np.uint8)
    tint = hollow.with_values(codes, 0.0)
    transfer = TransferFunction(np.array([0.0, 1.0]), np.ones((2, 3)), np.zeros(2))
    scene = Scene(hu, transfer, surface=AirSurface(hollow, tint, tint))
    turn = Rotation(np.array([6.0, 0, 0]), 4.0, np.array([0, 0, 1.0]), 1.0)
    cut = Cut(np.array([-7.0, 0, 0]), 2.5, np.array([0, 0, 1.0]), 0.8)
    found = deflected_scene(scene, Deflection((turn, cut)))
    assert found.surface is not None
    assert found.volume.values.dtype == np.int16
    assert found.surface.blood.values.dtype == np.uint8
    middle = tuple(
        np.rint(hollow.voxel_from_world @ (-7.0, 0, 0, 1)).astype(int)[2::-1]
    )
    assert found.volume.values[middle] == -1000
    assert found.surface.blood.values[middle] >= 72
    assert deflected_scene(Scene(hu, transfer), PUSH).surface is None
