"""The line to the nearest hazard, before hazards whose distance is known exactly."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from anatomy.hazard_volumes import UNIT_MM, HazardVolumes
from paravol.feedback.hazard_pointer import hazard_pointer, nearest_point_mm
from renderers.scene import Volume
from scenarios import FrameState
from scenarios.endoscope import Endoscope
from scenarios.instrument_state import NO_TOOL

CENTRE, RADIUS_MM = np.array([12.0, 12.0, 12.0]), 4.0


def ball() -> HazardVolumes:
    """A ball on a grid of half a millimetre."""
    axis = np.arange(49) * 0.5
    z, y, x = np.meshgrid(axis, axis, axis, indexing="ij")
    away = np.stack([x, y, z], axis=-1) - CENTRE
    distance = np.linalg.norm(away, axis=-1) - RADIUS_MM
    values = np.round(distance / UNIT_MM).astype(np.int16)
    return HazardVolumes({"orbit": Volume(values, np.full(3, 0.5), np.zeros(3))})


BALL = ball()


def looking(at_mm: NDArray[np.float64], from_mm: NDArray[np.float64]) -> FrameState:
    """A straight scope at a place, looking at another."""
    back = (from_mm - at_mm) / np.linalg.norm(from_mm - at_mm)
    side = np.cross(back, [0.3, 0.9, 0.1])
    side /= np.linalg.norm(side)
    tip = np.eye(4)
    tip[:3] = np.stack([side, np.cross(back, side), back, from_mm], axis=1)
    camera = Endoscope(angle_deg=0.0).camera(tip, 0.0, (200, 200))
    gap = float(np.linalg.norm(from_mm - CENTRE)) - RADIUS_MM
    return FrameState(camera, tip, np.eye(4), 1.0, "", ("orbit", gap), NO_TOOL)


@given(
    st.floats(0.0, 2.0 * math.pi),
    st.floats(0.3, math.pi - 0.3),
    st.floats(RADIUS_MM - 1.5, RADIUS_MM + 4.0),
)
def test_the_nearest_point_of_a_ball_lies_on_the_way_to_its_middle(
    turn: float, tilt: float, away_mm: float
) -> None:
    direction = np.array(
        [
            math.cos(turn) * math.sin(tilt),
            math.sin(turn) * math.sin(tilt),
            math.cos(tilt),
        ]
    )
    point = nearest_point_mm(BALL, "orbit", CENTRE + away_mm * direction)
    assert point is not None
    assert np.linalg.norm(point - (CENTRE + RADIUS_MM * direction)) < 0.25


def test_in_the_midst_of_a_hazard_no_point_is_nearest() -> None:
    assert nearest_point_mm(BALL, "orbit", CENTRE) is None


def test_whoever_looks_at_a_hazard_sees_it_in_the_middle() -> None:
    view = looking(CENTRE, CENTRE + np.array([0.0, 0.0, RADIUS_MM + 2.0]))
    pointer = hazard_pointer(view, BALL)
    assert pointer is not None
    assert pointer.begin is None  # the scope's own tip is not in its picture
    assert pointer.end == pytest.approx((0.5, 0.5), abs=0.03)


def test_the_line_begins_at_the_tool_where_that_is_nearer() -> None:
    scope = CENTRE + np.array([0.0, 0.0, RADIUS_MM + 6.0])
    view = looking(CENTRE, scope)
    tool = np.eye(4)
    tool[:3, 3] = CENTRE + np.array([1.0, 0.5, RADIUS_MM + 1.0])
    view = replace(
        view, world_from_instrument=tool, instrument="ball probe", hazard=("orbit", 1.1)
    )
    pointer = hazard_pointer(view, BALL)
    assert pointer is not None
    assert pointer.begin is not None
    seen, _ = view.camera.project(tool[:3, 3])
    assert pointer.begin == pytest.approx(tuple(seen / 200.0))
    # towards the ball's middle, which is in the picture's
    to_middle = np.subtract((0.5, 0.5), pointer.begin)
    along = np.subtract(pointer.end, pointer.begin)
    assert float(along @ to_middle) > 0.0


def test_what_is_far_behind_or_unknown_is_not_pointed_at() -> None:
    near = CENTRE + np.array([0.0, 0.0, RADIUS_MM + 2.0])
    view = looking(CENTRE, near)
    assert hazard_pointer(replace(view, hazard=None), BALL) is None
    assert hazard_pointer(replace(view, hazard=("orbit", 3.0)), BALL) is None
    away = looking(near + np.array([0.0, 0.0, 5.0]), near)
    assert hazard_pointer(away, BALL) is None
    lost = np.full((4, 4), np.nan)
    assert hazard_pointer(replace(view, world_from_tip=lost), BALL) is None
