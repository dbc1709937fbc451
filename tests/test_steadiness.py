import numpy as np
import pytest
from numpy.typing import NDArray

from renderers.scene import Camera, GBuffer
from tests.steadiness import carried, change, glints, orbited

SIZE = 64


def wall(camera: Camera, y_mm: float) -> GBuffer:
    """A plane across the view axis."""
    origin, ray = camera.rays()
    buffer = GBuffer.empty(camera.height, camera.width)
    seen = ray[..., 1] > 0.1
    buffer.depth_mm[seen] = ((y_mm - origin[..., 1]) / np.where(seen, ray[..., 1], 1))[
        seen
    ]
    buffer.normal[seen] = [0, -1, 0]
    buffer.coverage[seen] = 1
    return buffer


def painted(camera: Camera, buffer: GBuffer) -> NDArray[np.float64]:
    """A smooth pattern that belongs to the wall, in codes."""
    origin, ray = camera.rays()
    depth = np.where(buffer.coverage > 0, buffer.depth_mm, 0)
    points = origin + depth[..., None] * ray
    code = 120 + 60 * np.sin(points[..., 0] / 2) * np.cos(points[..., 2] / 3)
    return np.stack([code, code, code], axis=-1)


def test_what_belongs_to_a_wall_is_carried_along() -> None:
    before = Camera.looking_at([0.0, 0, 0], [0, 10, 0], size=(SIZE, SIZE))
    after = Camera.looking_at([0.1, 0.05, 0], [0.1, 10, 0], size=(SIZE, SIZE))
    one, two = wall(before, 12), wall(after, 12)
    predicted, usable = carried(painted(before, one), before, one, after, two)
    assert usable.mean() > 0.5
    found = change(painted(after, two), predicted, usable, after)
    assert found.mean < 0.3
    assert 0.7 < found.share < 1
    # where nothing is carried along the picture does change
    still = change(painted(after, two), painted(before, one), usable, after)
    assert still.mean > 3 * found.mean


def test_a_lamp_that_is_switched_on_is_a_change() -> None:
    camera = Camera.looking_at([0.0, 0, 0], [0, 10, 0], size=(SIZE, SIZE))
    buffer = wall(camera, 12)
    picture = painted(camera, buffer)
    predicted, usable = carried(picture, camera, buffer, camera, buffer)
    found = change(picture + 20, predicted, usable, camera)
    assert found.mean == pytest.approx(20, abs=0.5)


def test_what_was_hidden_is_not_predicted() -> None:
    camera = Camera.looking_at([0.0, 0, 0], [0, 10, 0], size=(SIZE, SIZE))
    near, far = wall(camera, 8), wall(camera, 12)
    _, usable = carried(painted(camera, near), camera, near, camera, far)
    assert not usable.any()


def test_an_orbit_keeps_its_distance_and_its_target() -> None:
    camera = Camera.looking_at([1.0, 2, 3], [4, 9, 5], size=(SIZE, SIZE))
    target = camera.eye_mm + 8 * camera.frame[3]
    moved = orbited(camera, 8.0, 1.0)
    assert np.linalg.norm(moved.eye_mm - target) == pytest.approx(8)
    assert np.linalg.norm(moved.eye_mm - camera.eye_mm) == pytest.approx(1, rel=0.01)
    position, _ = moved.project(target)
    np.testing.assert_allclose(position, [SIZE / 2, SIZE / 2], atol=1e-6)


def test_a_glint_is_white_in_all_channels() -> None:
    picture = np.array([[[255.0, 255, 230], [255, 200, 255]]])
    assert glints(picture).tolist() == [[True, False]]
