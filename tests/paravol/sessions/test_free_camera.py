"""A camera that flies by hand: turns undo each other, walls are never passed."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from paravol.sessions.free_camera import (
    CLEAR_MM,
    CameraMove,
    FreeCamera,
    shaft_in_scene,
)
from renderers.scene import Volume
from scenarios import Endoscope, tip_frame

ROOM_MM = 6.0
"""Half the edge of a room of air."""

FRAME = np.vstack([np.zeros(3), np.eye(3)])
DEGREES = st.floats(-90.0, 90.0)
MM = st.floats(-12.0, 12.0)


def room() -> Volume:
    """A cubic room; beyond a wall of 1 mm there is air again."""
    edge = np.arange(-10.0, 10.01, 0.5)
    z, y, x = np.meshgrid(edge, edge, edge, indexing="ij")
    reach = np.maximum(np.maximum(abs(x), abs(y)), abs(z))
    distance = 0.5 - abs(reach - (ROOM_MM + 0.5))
    return Volume(
        distance.astype(np.float32), np.full(3, 0.5), np.full(3, -10.0), np.eye(3), -1.0
    )


ROOM = room()


@given(DEGREES, DEGREES, DEGREES)
def test_axes_stay_orthonormal_and_a_turn_is_undone(
    right: float, up: float, roll: float
) -> None:
    camera = FreeCamera(FRAME)
    for part in ({"right_deg": right}, {"up_deg": up}, {"roll_deg": roll}):
        turned = camera.moved(CameraMove(**part), ROOM)
        back = turned.moved(CameraMove(**{k: -v for k, v in part.items()}), ROOM)
        assert np.allclose(back.frame, camera.frame, atol=1e-12)
        camera = turned
    axes = camera.frame[1:]
    assert np.allclose(axes @ axes.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(axes) == pytest.approx(np.linalg.det(FRAME[1:]))


def test_each_turn_goes_where_its_name_says() -> None:
    camera = FreeCamera(FRAME)
    right, up, forward = FRAME[1:]
    assert camera.moved(CameraMove(right_deg=30.0), ROOM).frame[3] @ right > 0.4
    assert camera.moved(CameraMove(up_deg=30.0), ROOM).frame[3] @ up > 0.4
    rolled = camera.moved(CameraMove(roll_deg=30.0), ROOM)
    assert rolled.frame[2] @ right > 0.4
    assert np.allclose(rolled.frame[3], forward)


@given(st.lists(st.tuples(MM, MM, MM), min_size=1, max_size=3))
def test_no_way_leads_through_a_thin_wall(
    ways: list[tuple[float, float, float]],
) -> None:
    camera = FreeCamera(FRAME)
    for way in ways:
        camera = camera.moved(CameraMove(0.0, 0.0, 0.0, *way), ROOM)
        assert np.abs(camera.frame[0]).max() <= ROOM_MM - CLEAR_MM + 0.3


def test_the_eye_slides_along_a_wall() -> None:
    camera = FreeCamera(FRAME).moved(CameraMove(ahead_mm=20.0, right_mm=4.0), ROOM)
    assert camera.frame[0][0] == pytest.approx(4.0, abs=0.2)
    assert camera.frame[0][2] == pytest.approx(ROOM_MM - CLEAR_MM, abs=0.3)


def test_a_shaft_stands_in_the_scene_but_not_before_an_eye_within_it() -> None:
    scope = Endoscope()
    pose = tip_frame(np.zeros(3), np.array([0.0, 1.0, 0.0]))
    assert not shaft_in_scene(scope, pose, np.zeros(3))
    assert not shaft_in_scene(scope, pose, np.array([0.5, -40.0, 0.0]))
    ((mesh, placed),) = shaft_in_scene(scope, pose, np.array([6.0, 0.0, 0.0]))
    assert np.array_equal(placed, pose)
    ends = mesh.vertices[:, 2].min(), mesh.vertices[:, 2].max()
    assert ends == pytest.approx((0.0, scope.shaft_length_mm), abs=0.05)
