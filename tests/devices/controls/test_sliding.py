"""Obstacles stop motions and turn them aside; they never let one deeper in."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from devices.controls.sliding import Gap, slid

Vector = NDArray[np.float64]
_number = st.floats(-5.0, 5.0)
_places = st.tuples(_number, _number, _number).map(np.array)
_lengths = st.floats(0.01, 0.5)


@st.composite
def _directions(draw: st.DrawFn) -> Vector:
    turn, height = draw(st.floats(0.0, math.tau)), draw(st.floats(-1.0, 1.0))
    across = math.sqrt(1.0 - height * height)
    return np.array((across * math.cos(turn), across * math.sin(turn), height))


def _anywhere(place: Vector) -> Vector:
    return place


def _plane(normal: Vector, offset: float) -> Gap:
    return lambda place: float(place @ normal) - offset


@given(
    _places,
    _directions(),
    _lengths,
    st.lists(st.tuples(_directions(), _number), min_size=1, max_size=4),
    st.floats(-0.5, 0.5),
)
def test_no_motion_goes_deeper_or_farther_than_it_may(
    start: Vector,
    direction: Vector,
    length: float,
    planes: list[tuple[Vector, float]],
    least: float,
) -> None:
    """For every place, motion and corner of up to four walls."""

    def gap(place: Vector) -> float:
        return min(_plane(*plane)(place) for plane in planes)

    end = start + length * direction
    place = slid(start, end, _anywhere, gap, least)
    assert gap(place) >= min(least, gap(start))
    assert np.linalg.norm(place - start) <= np.linalg.norm(end - start)
    if gap(end) >= least:
        assert place is end


@given(_directions(), _directions(), _lengths, st.floats(0.0, 0.2))
def test_a_flat_wall_takes_what_runs_into_it_and_nothing_else(
    normal: Vector, direction: Vector, length: float, room: float
) -> None:
    start = room * normal
    end = start + length * direction
    place = slid(start, end, _anywhere, _plane(normal, 0.0), 0.0)
    depth = min(float(end @ normal), 0.0)
    # The bisection ends within an eighth of the step.
    assert np.abs(place - (end - depth * normal)).max() <= length / 8 + 1e-5


@given(_directions(), _lengths)
def test_out_of_a_wall_every_way_is_free(normal: Vector, length: float) -> None:
    """What began inside comes out, and straight."""
    start = -0.3 * normal
    end = start + length * normal
    place = slid(start, end, _anywhere, _plane(normal, 0.0), 0.0)
    assert place is end


@pytest.mark.parametrize("slant_deg", [30.0, 60.0, 80.0])
def test_a_round_obstacle_is_slid_round(slant_deg: float) -> None:
    """Pushed at a slant against a ball, the place goes round on its surface."""

    def gap(place: Vector) -> float:
        return float(np.linalg.norm(place)) - 2.0

    place = np.array((2.0, 0.0, 0.0))
    slant = math.radians(slant_deg)
    turned = 0.0
    for _ in range(100):
        out = place / np.linalg.norm(place)
        aside = np.array((-out[1], out[0], 0.0))
        push = 0.05 * (math.sin(slant) * aside - math.cos(slant) * out)
        new = slid(place, place + push, _anywhere, gap, 0.0)
        turned += math.atan2(float(new @ aside), float(new @ out))
        place = new
        assert 0.0 <= gap(place) < 0.01
    # All of the part along the surface is kept.
    assert turned * 2.0 == pytest.approx(100 * 0.05 * math.sin(slant), rel=0.05)


def test_a_corner_holds() -> None:
    def gap(place: Vector) -> float:
        return min(float(place[0]), float(place[1]))

    start = np.array((1e-3, 1e-3, 0.0))
    place = slid(start, np.array((-0.2, -0.2, 0.0)), _anywhere, gap, 0.0)
    assert np.abs(place[:2]).max() < 2e-3


def test_bounds_hold_for_what_is_turned_aside() -> None:
    def bounded(place: Vector) -> Vector:
        return np.minimum(place, 0.05)

    start, end = np.zeros(2), np.array((0.2, -0.2))
    place = slid(start, end, bounded, _plane(np.array((0.0, 1.0)), 0.0), 0.0)
    assert place[0] == pytest.approx(0.05)
    assert place[1] >= 0.0
