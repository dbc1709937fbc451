import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from renderers.fsr.kernels.project_surfels import (
    NO_TILE,
    RECORD,
    DiscLimits,
    SurfelBuffers,
    project_surfels,
)
from renderers.fsr.view_bounds import lens_of
from renderers.scene import Camera, Projection


def facing(camera: Camera, position: NDArray[np.float32]) -> NDArray[np.float32]:
    """Give the normals of discs that face the eye."""
    away = camera.eye_mm - position
    normal = away / np.linalg.norm(away, axis=1, keepdims=True)
    result: NDArray[np.float32] = normal.astype(np.float32)
    return result


def project(
    camera: Camera,
    position: NDArray[np.float32],
    normal: NDArray[np.float32],
    radius: float = 0.2,
) -> tuple[NDArray[np.float32], NDArray[np.int32], NDArray[np.int32]]:
    """Project discs; give their records, boxes and ranges of tiles."""
    count = len(position)
    room = np.zeros((16, 3), np.float32)
    records = np.zeros((count + 1, RECORD), np.float32)
    boxes = np.zeros((count + 1, 4), np.int32)
    ranges = np.zeros(count, np.int32)
    project_surfels(
        np.array([[0, count]]),
        0,
        1,
        np.concatenate([position, room]),
        np.concatenate([normal, room]),
        camera.frame.astype(np.float32),
        lens_of(camera),
        DiscLimits(*map(np.float32, (1e-3, np.inf, radius, 0.004))),
        SurfelBuffers(records, boxes, ranges),
        0,
    )
    return records[:count], boxes[:count], ranges


@pytest.mark.parametrize("projection", [Projection.EQUIDISTANT, Projection.PERSPECTIVE])
@given(seed=st.integers(0, 10**6))
def test_centres_agree_with_the_camera(projection: Projection, seed: int) -> None:
    rng = np.random.default_rng(seed)
    camera = Camera.looking_at(
        rng.uniform(-5, 5, 3), (7.0, 1.0, 2.0), size=(512, 400), projection=projection
    )
    _, ray = camera.rays()
    rows, columns = rng.integers(100, 300, (2, 40))
    distance = rng.uniform(2, 60, (40, 1))
    p = (camera.eye_mm + distance * ray[rows, columns]).astype(np.float32)
    records, boxes, _ = project(camera, p, facing(camera, p))
    assert len(records) == 40
    pixel, depth = camera.project(p)
    np.testing.assert_allclose(records[:, 9:11], pixel, atol=0.01)
    # 1 / q along the centre's own ray is its distance
    w = (p - camera.eye_mm) / depth[:, None] @ camera.frame[1:].T
    np.testing.assert_allclose(1 / (records[:, 3:6] * w).sum(1), depth, rtol=1e-5)
    assert np.all((boxes[:, 0] <= columns) & (columns <= boxes[:, 1]))
    assert np.all((boxes[:, 2] <= rows) & (rows <= boxes[:, 3]))


@pytest.mark.parametrize("projection", [Projection.EQUIDISTANT, Projection.PERSPECTIVE])
@pytest.mark.parametrize("distance", [0.25, 0.7, 3.0, 20.0])
def test_boxes_hold_the_whole_rim(projection: Projection, distance: float) -> None:
    camera = Camera.looking_at(
        (0, 0, 0), (0, 1, 0), size=(256, 256), projection=projection
    )
    radius = 0.2
    rng = np.random.default_rng(8)
    turn = np.linspace(0, 2 * np.pi, 64)
    for _ in range(20):
        direction = np.array([*rng.uniform(-0.5, 0.5, 2), 1.0])[[0, 2, 1]]
        p = distance * direction / np.linalg.norm(direction)
        q = p[None].astype(np.float32)
        records, boxes, _ = project(camera, q, facing(camera, q), radius)
        n = -p / distance
        a = np.cross(n, (0.3, 0.5, 0.8))
        a /= np.linalg.norm(a)
        rim = p + radius * (
            np.cos(turn)[:, None] * a + np.sin(turn)[:, None] * np.cross(n, a)
        )
        pixel, _ = camera.project(rim)
        low, high = pixel.min(axis=0), pixel.max(axis=0)
        box = boxes[0]
        # a pixel is touched when its centre is; clipped to the picture
        assert box[0] <= max(np.ceil(low[0] - 0.5), 0) + 0.5
        assert box[1] >= min(np.floor(high[0] - 0.5), 255) - 0.5
        assert box[2] <= max(np.ceil(low[1] - 0.5), 0) + 0.5
        assert box[3] >= min(np.floor(high[1] - 0.5), 255) - 0.5
        assert records[0, 14] <= distance


def test_discs_that_face_away_are_left_out() -> None:
    camera = Camera.looking_at((0, 0, 0), (0, 1, 0))
    p = np.array([[0, 5, 0]], np.float32)
    for towards, wanted in ((-1.0, True), (1.0, False)):
        normal = np.array([[0, towards, 0]], np.float32)
        _, _, ranges = project(camera, p, normal)
        assert (ranges[0] != NO_TILE) == wanted
