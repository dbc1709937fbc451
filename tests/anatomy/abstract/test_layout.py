"""Laws of hoops: a torus, to rounding; and of what a straight scope reaches."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from anatomy.abstract.boxes import Box, BoxSpace
from anatomy.abstract.layout import WIRE_MM, Hoop, Layout

ROOM: Box = ((-10.0, 10.0), (0.0, 40.0), (-10.0, 10.0))
ANGLE = st.floats(0, 2 * math.pi)


@given(ANGLE, ANGLE, st.floats(0.0, 3.0))
def test_a_hoop_is_a_torus(turn: float, about: float, away_mm: float) -> None:
    axis = np.array([0.6, 0.8, 0.0])
    u, v = np.array([0.8, -0.6, 0.0]), np.array([0.0, 0.0, 1.0])
    hoop = Hoop(np.array([1.0, 2.0, 3.0]), axis, 4.0)
    out = math.cos(turn) * u + math.sin(turn) * v
    way = math.cos(about) * out + math.sin(about) * axis
    at = hoop.middle + 4.0 * out + away_mm * way
    assert hoop.depth_mm(*at) == pytest.approx(WIRE_MM - away_mm, abs=1e-9)
    assert hoop.depth_mm(*hoop.middle) == pytest.approx(-hoop.opening_mm)


def test_a_wall_a_hoop_and_a_narrow_hole_stop_a_scope() -> None:
    def layout(*hoops: Hoop, mouth: float = 5.0) -> Layout:
        hole: Box = ((-mouth, mouth), (-np.inf, 0.0), (-mouth, mouth))
        corner, pivot = np.zeros(3), np.array([0.0, -1.0, 0.0])
        return Layout(BoxSpace.of([ROOM, hole]), corner, corner, pivot, {}, hoops)

    ahead = np.array([0.0, 20.0, 0.0])
    forwards = np.array([0.0, 1.0, 0.0])
    assert layout().is_open_to(ahead)
    assert layout().is_open_to(ahead, past_mm=15.0)
    assert not layout().is_open_to(ahead, past_mm=19.0)
    assert not layout(mouth=2.0).is_open_to(ahead)
    assert layout(Hoop(ahead / 2, forwards, 4.0)).is_open_to(ahead)
    beside = Hoop(ahead / 2 + [4.0, 0, 0], forwards, 4.0)
    assert not layout(beside).is_open_to(ahead)
