"""Solids that tools sweep: distances with closed forms, unions, bad numbers."""

from collections.abc import Callable
from functools import partial
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from surgery import solids
from surgery.kernels.solid_distance import solids_distance
from system import UserError

Place = tuple[float, float, float]
place = st.tuples(*[st.floats(-20, 20)] * 3)


def distance(point: Place, rows: solids.Rows) -> float:
    x, y, z = map(float, point)
    return solids_distance(x, y, z, rows)


@given(place, place, st.floats(0.1, 5.0), place)
def test_a_capsule_is_as_far_as_its_axis_less_its_radius(
    a: Place, b: Place, radius: float, point: Place
) -> None:
    along = np.linspace(0, 1, 4001)[:, None]
    on_axis = np.array(a) + along * np.subtract(b, a)
    nearest = np.linalg.norm(on_axis - np.array(point), axis=1).min()
    found = distance(point, solids.capsule(a, b, radius))
    # the axis is sampled at steps of at most 0.02 mm
    assert found <= nearest - radius + 1e-9
    assert found >= nearest - radius - 0.02


@given(place, place, place, place, place)
def test_a_blade_is_no_farther_than_any_of_its_points(
    p: Place, q: Place, r: Place, s: Place, point: Place
) -> None:
    rows = solids.blade([p, q], [r, s], 0.4)
    found = distance(point, rows) + 0.4
    for t in np.linspace(0, 1, 9):
        for u in np.linspace(0, 1 - t, 9):
            for a, b, c in ((p, q, s), (p, s, r)):
                on_it = np.array(a) + t * np.subtract(b, a) + u * np.subtract(c, a)
                assert found <= np.linalg.norm(point - on_it) + 1e-9


def test_a_flat_blade_is_as_far_as_its_plane() -> None:
    rows = solids.blade([[0, 0, 0], [4, 0, 0]], [[0, 6, 0], [4, 6, 0]], 0.5)
    for x, y, z in ((1, 1, 2), (3.9, 5, -1), (2, 3, 0.25)):
        assert distance((x, y, z), rows) == pytest.approx(abs(z) - 0.5)


@given(place, st.integers(0, 1000), st.lists(st.floats(0, 1), max_size=6))
def test_parts_of_a_rough_sweep_are_the_whole(
    point: Place, seed: int, cuts: list[float]
) -> None:
    a, b = np.array([0.0, 1.0, -2.0]), np.array([6.0, -3.0, 4.0])
    capsule = partial(solids.capsule, radius_mm=1.5, rough_mm=0.2, seed=seed)
    whole = capsule(a, b)
    at = np.array([0.0, *sorted(cuts), 1.0])[:, None]
    stops = a + at * (b - a)
    parts = np.concatenate([capsule(p, q) for p, q in pairwise(stops)])
    assert distance(point, parts) == pytest.approx(distance(point, whole), abs=1e-9)


@given(place, place, place, st.floats(0.2, 3))
def test_bounds_hold_everything_inside(
    a: Place, b: Place, point: Place, radius: float
) -> None:
    rows = np.concatenate(
        [
            solids.capsule(a, b, radius, rough_mm=0.2, seed=4),
            solids.blade([[1, 0, 0], [0, 2, 0]], [[0, 0, 3], [2, 1, 1]], 0.3),
        ]
    )
    low, high = solids.bounds(rows)
    if distance(point, rows) <= 0:
        assert np.all(point >= low - 1e-9)
        assert np.all(point <= high + 1e-9)


@pytest.mark.parametrize(
    ("make", "named"),
    [
        (lambda: solids.capsule([0, 0, np.nan], [0, 0, 0], 1), "finite"),
        (lambda: solids.capsule([0, 0, 0], [0, 0, 0], 0), "positive radius"),
        (lambda: solids.capsule([0, 0, 0], [0, 0, 5000], 1), "cannot sweep"),
        (lambda: solids.capsule([0, 0, 0], [0, 0, 1], 1, rough_mm=9), "roughness"),
        (lambda: solids.checked(np.zeros((2, 3))), "rows of 16"),
        (lambda: solids.checked(np.full((1, 16), 7.0)), "kind 0 or 2"),
    ],
)
def test_what_is_no_solid_is_refused_by_name(
    make: Callable[[], object], named: str
) -> None:
    with pytest.raises(UserError, match=named):
        make()
