"""Drag on the nostril: a distance of lines, summed over time."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scenarios.nostril import (
    ABSENT_S,
    BELOW_MM,
    STIFFNESS_N_MM,
    Nostrils,
    NostrilWatch,
    ToolWatch,
    drag_mm,
)

vectors = st.tuples(*[st.floats(-20.0, 20.0)] * 3).map(np.array)
ways = vectors.filter(lambda v: float(np.linalg.norm(v)) > 0.1)


@given(vectors, ways, vectors)
def test_the_drag_is_the_distance_of_the_line_and_not_of_the_hand(
    tip: np.ndarray, way: np.ndarray, place: np.ndarray
) -> None:
    back = way / np.linalg.norm(way)
    found = drag_mm(place[None], tip, back)
    along = (place - tip) @ back
    if along <= 0.0:
        assert found is None
        return
    exact = float(np.linalg.norm(np.cross(place - tip, back)))
    assert found == pytest.approx(exact, abs=1e-5)
    # how deep it is and how it is turned about itself says nothing
    assert drag_mm(place[None], tip - 5.0 * back, back) == pytest.approx(
        exact, abs=1e-5
    )


def test_a_tool_lies_below_the_scope_across_the_way_in() -> None:
    way = np.array([0.1, 0.8, 0.5])
    both = Nostrils.of(np.zeros((1, 3)), way[None])
    off = both.tool_mm[0] - both.scope_mm[0]
    assert np.linalg.norm(off) == pytest.approx(BELOW_MM)
    assert off @ way == pytest.approx(0.0, abs=1e-12)
    assert off[2] < 0.0


@given(st.floats(0.0, 9.0), st.floats(0.0, 9.0))
def test_loads_are_means_over_time_and_leave_gaps_out(one: float, two: float) -> None:
    watch = NostrilWatch()
    assert watch.load() is None
    times = 0.1, 0.2, 0.4, 0.4 + 2 * ABSENT_S, 2.0, 2.1
    for time_s, drag in zip(times, (one, two, two, None, one, None), strict=True):
        watch.add(time_s, drag)
    load = watch.load()
    assert load is not None
    assert load.time_s == pytest.approx(0.4)
    assert load.mean_mm == pytest.approx((0.1 * one + 0.2 * two + 0.1 * one) / 0.4)
    assert load.most_mm == max(one, two)
    assert load.mean_n == pytest.approx(STIFFNESS_N_MM * load.mean_mm)


def test_contacts_of_a_tool_are_counted_once_each() -> None:
    watch = ToolWatch()
    depths = 0.0, 0.1, 0.3, 0.0, 0.2, 0.0
    for number, depth in enumerate(depths):
        watch.add(0.1 * number, depth, "septum" if depth else "")
    found = watch.found
    assert (found.contacts, found.worst_depth_mm) == (2, 0.3)
    assert found.worst_structure == "septum"
    assert found.contact_s == pytest.approx(0.3)
