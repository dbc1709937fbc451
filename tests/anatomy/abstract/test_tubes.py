"""Laws of tubes: smooth chains of arcs, and exact distances to their walls."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from anatomy.abstract.tubes import TubeSpace, chain
from system import UserError

RADIUS_MM = 5.0
PIECES = st.lists(
    st.tuples(st.floats(4, 14), st.floats(15, 60), st.floats(0, 360)),
    min_size=1,
    max_size=3,
)
PLACE = st.tuples(st.floats(-25, 25), st.floats(-25, 60), st.floats(-25, 25))


def test_a_straight_tube_has_the_closed_form_of_a_capsule() -> None:
    tube = TubeSpace(chain((0.0, 1.0, 0.0), [(10.0, math.inf, 0.0)]), 2.0)
    x, y, z = np.array([[0, 5, 0], [3, 5, 0], [0, 14, 0], [3, 11, 4], [0, -4, 0]]).T
    found = tube.distance_mm(x.astype(float), y.astype(float), z.astype(float))
    assert found == pytest.approx([-2.0, 1.0, 1.0, 3.0, 3.0])


@given(PIECES, PLACE)
def test_the_distance_is_that_to_the_nearest_of_many_places_on_the_line(
    pieces: list[tuple[float, float, float]], place: tuple[float, float, float]
) -> None:
    tube = TubeSpace(chain((0.0, 0.0, 0.0), pieces), RADIUS_MM)
    ways = np.arange(0.0, tube.length_mm, 0.02)
    line = np.array([tube.at(float(way))[0] for way in ways])
    at = np.array(place)
    apart = np.linalg.norm(line - at, axis=1).min()
    found = tube.distance_mm(*at) + RADIUS_MM
    assert apart - 0.02 <= found <= apart + 1e-9


@given(PIECES)
def test_arcs_go_on_where_and_as_the_last_one_ends(
    pieces: list[tuple[float, float, float]],
) -> None:
    arcs = chain((1.0, 2.0, 3.0), pieces)
    for before, after in pairwise(arcs):
        place, along = before.at(before.length_mm)
        assert after.start == pytest.approx(place, abs=1e-9)
        assert after.along == pytest.approx(along, abs=1e-9)
    for arc in arcs:
        vectors = np.stack([arc.along, arc.inwards])
        assert vectors @ vectors.T == pytest.approx(np.eye(2), abs=1e-9)


@given(PIECES, st.floats(0, 1), st.floats(0, 2 * math.pi), st.floats(0.05, 0.95))
def test_from_a_place_in_the_tube_the_wall_is_as_far_as_it_says(
    pieces: list[tuple[float, float, float]], share: float, turn: float, out: float
) -> None:
    tube = TubeSpace(chain((0.0, 0.0, 0.0), pieces), RADIUS_MM)
    middle, along = tube.at(share * tube.length_mm)
    across = np.cross(along, (1.0, 0.0, 0.0))
    across /= np.linalg.norm(across)
    away = math.cos(turn) * across + math.sin(turn) * np.cross(along, across)
    at = middle + out * RADIUS_MM * away
    assert tube.distance_mm(*at) == pytest.approx((out - 1) * RADIUS_MM, abs=1e-9)
    assert tube.distance_mm(*(middle + RADIUS_MM * away)) == pytest.approx(0, abs=1e-9)


def test_a_tube_that_bends_too_tightly_is_refused() -> None:
    with pytest.raises(UserError, match="cannot bend as tightly as 4 mm"):
        TubeSpace(chain((0.0, 0.0, 0.0), [(5.0, 4.0, 0.0)]), RADIUS_MM)
