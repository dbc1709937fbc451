"""What the ray tracer's tests look at, and from where."""

import numpy as np
import pytest

from renderers.art import tracer
from renderers.scene import AirSurface, Camera, Projection, Scene
from tests.scenes import make_scene


@pytest.fixture(scope="session")
def scene() -> Scene:
    """Get the small scene."""
    return make_scene()


@pytest.fixture(scope="session")
def surface(scene: Scene) -> AirSurface:
    """Get the small scene's air."""
    assert scene.surface is not None
    return scene.surface


@pytest.fixture(scope="session")
def outside(scene: Scene) -> Camera:
    """Get a pinhole view of the small scene from outside."""
    centre = scene.volume.center_mm
    return Camera.looking_at(
        centre + np.array([26.0, -18, 10]),
        centre,
        extent=0.5,
        size=(50, 43),
        projection=Projection.PERSPECTIVE,
    )


@pytest.fixture(scope="session")
def inside(surface: AirSurface) -> Camera:
    """Get a scope's view from a point in the small scene's air."""
    distance = surface.distance
    k, j, i = np.unravel_index(int(distance.values.argmin()), distance.shape)
    eye = (distance.world_from_voxel @ [i, j, k, 1.0])[:3]
    return Camera.looking_at(eye, eye + np.array([0.3, 1.0, 0.2]), size=(50, 43))


@pytest.fixture
def steady_pace(monkeypatch: pytest.MonkeyPatch) -> None:
    """Draw so few blocks between two looks, however long they take."""

    def few_blocks(blocks: int, spent_s: float, threads: int) -> int:
        return 2 * threads

    monkeypatch.setattr(tracer, "next_blocks", few_blocks)
