"""Laws of spaces cut out by boxes: the distance is that to the nearest other side."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from anatomy.abstract.boxes import Box, BoxSpace

SIDE = 5
RANGES = st.tuples(st.integers(0, SIDE - 1), st.integers(1, SIDE)).map(
    lambda of: (of[0], min(of[0] + of[1], SIDE))
)
BOXES = st.lists(st.tuples(RANGES, RANGES, RANGES), min_size=1, max_size=4)
PLACE = st.tuples(*[st.floats(-2, SIDE + 2)] * 3)


def test_one_room_has_the_closed_form_of_a_box() -> None:
    space = BoxSpace.of([((-1.0, 1.0), (-2.0, 2.0), (-3.0, 3.0))])
    x = np.array([0.0, 0.5, 2.0, 4.0, 1.0])
    y = np.array([0.0, 1.9, 0.0, 6.0, 0.0])
    z = np.array([0.0, 0.0, 0.0, 15.0, 0.0])
    found = space.distance_mm(x, y, z)
    assert found == pytest.approx([-1.0, -0.1, 1.0, 13.0, 0.0])


@given(BOXES, st.lists(st.tuples(RANGES, RANGES, RANGES), max_size=3), PLACE)
def test_the_distance_is_that_to_the_nearest_cube_of_the_other_kind(
    rooms: list[Box], blocks: list[Box], place: tuple[float, float, float]
) -> None:
    # every unit cube is all air or all solid, with solid around them
    is_air = np.zeros([SIDE + 2] * 3, np.bool_)
    for boxes, value in ((rooms, True), (blocks, False)):
        for box in boxes:
            cells = tuple(slice(int(low) + 1, int(high) + 1) for low, high in box)
            is_air[cells] = value
    at = np.array(place)
    to_air, to_solid = (_nearest_cube(at, wanted) for wanted in (is_air, ~is_air))
    if np.any((at < -1.0) | (at > SIDE + 1.0)):
        to_solid = 0.0
    found = BoxSpace.of(rooms, blocks).distance_mm(*at)
    assert found == pytest.approx(to_air - to_solid, abs=1e-12)


@given(BOXES, PLACE)
def test_a_mirrored_space_has_the_same_bits(
    rooms: list[Box], place: tuple[float, float, float]
) -> None:
    x, y, z = np.array(place)
    swapped = [((-b, -a), other, third) for (a, b), other, third in rooms]
    here = BoxSpace.of(rooms).distance_mm(x, y, z)
    there = BoxSpace.of(swapped).distance_mm(-x, y, z)
    assert here.tobytes() == there.tobytes()


def _nearest_cube(at: NDArray[np.float64], wanted: NDArray[np.bool_]) -> float:
    low = np.argwhere(wanted) - 1.0
    away = np.maximum(np.maximum(low - at, at - low - 1.0), 0.0)
    return float(np.linalg.norm(away, axis=1).min(initial=np.inf))
