"""What a scene accepts."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from renderers.scene import (
    AirSurface,
    Light,
    PhongMaterial,
    Scene,
    TransferFunction,
    Volume,
)
from tests.scenes import make_scene


def volume(dtype: Any, shape: tuple[int, int, int] = (3, 4, 5)) -> Volume:
    return Volume(np.zeros(shape, dtype), np.ones(3), np.zeros(3))


def test_a_scene_without_air_has_four_lights_and_no_surface() -> None:
    clear = TransferFunction(np.array([0.0, 1]), np.ones((2, 3)), np.zeros(2))
    scene = Scene(volume(np.float32), clear)
    assert scene.surface is None
    assert len(scene.lights) == 4


def test_an_air_surface_is_one_grid_of_fixed_types() -> None:
    surface = AirSurface(volume(np.float32), volume(np.uint8), volume(np.uint8))
    assert surface.blood.shape == surface.distance.shape


@pytest.mark.parametrize(
    ("distance", "blood", "skin"),
    [
        (volume(np.float64), volume(np.uint8), volume(np.uint8)),
        (volume(np.float32), volume(np.float32), volume(np.uint8)),
        (volume(np.float32), volume(np.uint8), volume(np.int16)),
        (volume(np.float32), volume(np.uint8, (3, 4, 6)), volume(np.uint8)),
    ],
)
def test_other_types_or_shapes_are_refused(
    distance: Volume, blood: Volume, skin: Volume
) -> None:
    with pytest.raises(ValueError, match="must be"):
        AirSurface(distance, blood, skin)


@pytest.fixture
def lit_scene() -> Scene:
    """A local light of one channel above the origin, an infinite one of another."""
    lights = (
        Light(np.array([0.0, 0, 10]), np.array([1.0, 0, 0]), is_local=True),
        Light(np.array([0.0, 3, 4]), np.array([0.0, 0, 2])),
    )
    return replace(make_scene(), lights=lights, material=PhongMaterial(0.2, 0.5))


def test_light_falls_by_the_cosine(lit_scene: Scene) -> None:
    normals = np.array([[0, 0, 1], [0, 0, 1], [0, 0, -1], [0, 0, 0], [0, 1, 0]])
    places = np.array([[0, 0, 0], [10, 0, 0], [0, 0, 0], [0, 0, 0], [0, 0, 10]])
    found = lit_scene.diffuse_light(normals.astype(np.float32), places.astype(float))
    local = 0.2 + 0.5 * np.array([1, np.sqrt(0.5), 0, 0, 0])
    infinite = 0.2 + 0.5 * 2 * np.array([0.8, 0.8, 0, 0, 0.6])
    np.testing.assert_allclose(found[:, 0], local)
    np.testing.assert_allclose(found[:, 1], 0.2)
    np.testing.assert_allclose(found[:, 2], infinite)
