"""Ambient and diffuse light of infinite and local lights, by the cosine."""

from dataclasses import replace

import numpy as np
import pytest

from renderers.scene import Light, PhongMaterial, Scene
from renderers.scene.diffuse import diffuse_light
from tests.scenes import make_scene


@pytest.fixture
def scene() -> Scene:
    """A local light of one channel above the origin, an infinite one of another."""
    lights = (
        Light(np.array([0.0, 0, 10]), np.array([1.0, 0, 0]), is_local=True),
        Light(np.array([0.0, 3, 4]), np.array([0.0, 0, 2])),
    )
    return replace(make_scene(), lights=lights, material=PhongMaterial(0.2, 0.5))


def test_light_falls_by_the_cosine(scene: Scene) -> None:
    normals = np.array([[0, 0, 1], [0, 0, 1], [0, 0, -1], [0, 0, 0], [0, 1, 0]])
    places = np.array([[0, 0, 0], [10, 0, 0], [0, 0, 0], [0, 0, 0], [0, 0, 10]])
    found = diffuse_light(scene, normals.astype(np.float32), places.astype(float))
    local = 0.2 + 0.5 * np.array([1, np.sqrt(0.5), 0, 0, 0])
    infinite = 0.2 + 0.5 * 2 * np.array([0.8, 0.8, 0, 0, 0.6])
    np.testing.assert_allclose(found[:, 0], local)
    np.testing.assert_allclose(found[:, 1], 0.2)
    np.testing.assert_allclose(found[:, 2], infinite)
