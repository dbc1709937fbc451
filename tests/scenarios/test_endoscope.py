import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from scenarios import Endoscope, tip_frame

unit = st.floats(-1.0, 1.0)


def pointing(x: float, y: float, z: float) -> NDArray[np.float64]:
    v = np.array([x, y, z])
    n = float(np.linalg.norm(v))
    return v / n if n > 0.1 else np.array([0.0, 1.0, 0.0])


@given(unit, unit, unit, st.floats(-720, 720), st.sampled_from([0.0, 30.0, 70.0]))
def test_view_axis_leaves_the_shaft_by_exactly_the_scope_angle(
    x: float, y: float, z: float, roll: float, angle: float
) -> None:
    axis = pointing(x, y, z)
    frame = tip_frame(np.array([1.0, 2.0, 3.0]), axis)
    camera = Endoscope(angle_deg=angle).camera(frame, roll, (64, 64))
    cosine = float(np.clip(camera.frame[3] @ axis, -1, 1))
    # arccos loses half the digits near 1: compare the cosines instead
    assert cosine == pytest.approx(math.cos(math.radians(angle)), abs=1e-12)
    assert np.array_equal(camera.eye_mm, [1.0, 2.0, 3.0])


@given(st.floats(-360, 360))
def test_turning_the_light_post_keeps_the_horizon(roll: float) -> None:
    frame = tip_frame(np.zeros(3), np.array([0.1, 1.0, 0.3]))
    camera = Endoscope(angle_deg=30.0).camera(frame, roll, (64, 64))
    assert camera.frame[1][2] == pytest.approx(0.0, abs=1e-12)
    assert camera.frame[2][2] > 0


@given(unit, unit, unit, st.floats(-180, 180), st.floats(-180, 180))
def test_the_camera_head_turns_the_picture_about_the_view_and_nothing_else(
    x: float, y: float, z: float, roll: float, turn: float
) -> None:
    frame = tip_frame(np.zeros(3), pointing(x, y, z))
    scope = Endoscope(angle_deg=30.0)
    upright = scope.camera(frame, roll, (64, 64)).frame
    turned = scope.camera(frame, roll, (64, 64), turn).frame
    assert np.array_equal(turned[[0, 3]], upright[[0, 3]])
    # right-handed about the view: what was up moves to the right
    c, s = math.cos(math.radians(turn)), math.sin(math.radians(turn))
    assert turned[2] == pytest.approx(c * upright[2] + s * upright[1], abs=1e-12)
    # right, up and forward: as they were before, no mirror
    assert np.linalg.det(turned[1:]) == pytest.approx(np.linalg.det(upright[1:]))
    assert np.allclose(turned[1:] @ turned[1:].T, np.eye(3), atol=1e-12)


def test_light_post_up_looks_up_and_right_looks_right() -> None:
    frame = tip_frame(np.zeros(3), np.array([0.0, 1.0, 0.0]))
    scope = Endoscope(angle_deg=30.0)
    upwards = scope.camera(frame, 0.0, (64, 64)).frame[3]
    assert upwards == pytest.approx([0.0, math.cos(math.pi / 6), 0.5], abs=1e-12)
    # looking to the back (+y) with up = +z, the picture's right is the patient's
    # right side of the nose seen from the front: world -x ... cross((0,1,0),(0,0,1))
    sideways = scope.camera(frame, 90.0, (64, 64)).frame[3]
    assert sideways == pytest.approx([0.5, math.cos(math.pi / 6), 0.0], abs=1e-12)


def test_roll_of_the_tip_frame_is_ignored() -> None:
    frame = tip_frame(np.zeros(3), np.array([0.2, 1.0, 0.1]))
    turned = frame.copy()
    c, s = math.cos(1.0), math.sin(1.0)
    turned[:3, 0] = c * frame[:3, 0] + s * frame[:3, 1]
    turned[:3, 1] = -s * frame[:3, 0] + c * frame[:3, 1]
    a = Endoscope(angle_deg=30.0).camera(frame, 20.0, (64, 64)).frame
    b = Endoscope(angle_deg=30.0).camera(turned, 20.0, (64, 64)).frame
    assert np.array_equal(a, b)


@pytest.mark.parametrize("direction", [(0, 0, 1), (0, 0, -1), (1e-4, 0, 1)])
def test_looking_straight_up_or_down_is_finite(
    direction: tuple[float, float, float],
) -> None:
    frame = tip_frame(np.zeros(3), np.array(direction, dtype=np.float64))
    camera = Endoscope().camera(frame, 0.0, (64, 64))
    assert np.all(np.isfinite(camera.frame))


def test_field_of_view_reaches_the_stop() -> None:
    frame = tip_frame(np.zeros(3), np.array([0.0, 1.0, 0.0]))
    camera = Endoscope(field_of_view_deg=80.0).camera(frame, 0.0, (512, 512))
    edge = np.array([math.sin(math.radians(40)), math.cos(math.radians(40)), 0.0])
    pixel, _ = camera.project(10 * edge)
    assert abs(pixel[0] - 256) == pytest.approx(256, abs=1e-9)


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("diameter_mm", 0.0),
        ("angle_deg", -1.0),
        ("field_of_view_deg", math.nan),
        ("ring_radius_mm", 3.0),
    ],
)
def test_impossible_scopes_are_refused_by_name(field: str, value: float) -> None:
    word = field.split("_")[0]
    with pytest.raises(ValueError, match=word):
        Endoscope(**{field: value})
