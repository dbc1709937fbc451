"""Where the shaft goes in the picture: the place that does not move as it goes in."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from paravol.feedback.shaft_heading import shaft_heading
from scenarios import Endoscope, tip_frame

SIZE = (512, 512)
FORWARD = np.array([0.0, 1.0, 0.0])


@given(
    st.floats(10.0, 70.0),
    st.floats(-180.0, 180.0),
    st.floats(-180.0, 180.0),
    st.floats(-60.0, 60.0),
)
def test_it_lies_the_scope_s_angle_from_the_middle_and_stays_there(
    angle_deg: float, roll_deg: float, head_deg: float, up_deg: float
) -> None:
    scope = Endoscope(angle_deg=angle_deg)
    up = math.radians(up_deg)
    pointing = np.array([0.0, math.cos(up), math.sin(up)])
    frame = tip_frame(np.zeros(3), pointing)
    camera = scope.camera(frame, roll_deg, SIZE, head_deg)
    heading = shaft_heading(camera, frame)
    assert heading is not None
    # the lens shows angles in proportion, half the field on half the width
    away = math.hypot(heading[0] - 0.5, heading[1] - 0.5)
    assert away == pytest.approx(angle_deg / scope.field_of_view_deg, abs=1e-6)
    for ahead_mm, gone_mm in ((20.0, 0.0), (20.0, 15.0), (20.0, 19.9)):
        moved = tip_frame(gone_mm * pointing, pointing)
        seen = scope.camera(moved, roll_deg, SIZE, head_deg)
        pixel, _ = seen.project(ahead_mm * pointing)
        np.testing.assert_allclose(pixel / 512.0, heading, atol=1e-4)


@pytest.mark.parametrize(
    ("roll_deg", "place"),
    [(0.0, (0.5, 0.875)), (90.0, (0.125, 0.5)), (180.0, (0.5, 0.125))],
)
def test_it_lies_opposite_the_light_post(
    roll_deg: float, place: tuple[float, float]
) -> None:
    frame = tip_frame(np.zeros(3), FORWARD)
    camera = Endoscope(angle_deg=30.0).camera(frame, roll_deg, SIZE)
    heading = shaft_heading(camera, frame)
    assert heading == pytest.approx(place, abs=1e-6)


def test_a_straight_scope_goes_where_it_looks() -> None:
    frame = tip_frame(np.zeros(3), FORWARD)
    assert shaft_heading(Endoscope().camera(frame, 0.0, SIZE), frame) is None
