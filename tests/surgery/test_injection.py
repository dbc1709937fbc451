"""What is injected pales tissue: how far, where not, and again the same."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from renderers.scene import Volume
from surgery.injection import DRAWN_ML, EDGE_MM, ML_PER_S, SHARE, Injection, radius_mm
from system import UserError

SPACING, COUNT = 0.5, 49
MIDDLE = np.array([12.0, 12.0, 12.0])
Z = SPACING * np.arange(COUNT)


def slabs(gap_mm: float = 0.0) -> Volume:
    """Tissue with a slit of air across z, 2 mm above the middle."""
    away = np.abs(Z - 14.0 - gap_mm / 2) - gap_mm / 2
    away = np.full(COUNT, 9.0) if gap_mm == 0.0 else away
    values = np.broadcast_to(away[:, None, None], (COUNT,) * 3).astype(np.float32)
    return Volume(np.ascontiguousarray(values), np.full(3, SPACING), np.zeros(3))


def begun(distance: Volume) -> tuple[Injection, NDArray[np.uint8]]:
    pale: NDArray[np.uint8] = np.zeros(distance.shape, np.uint8)
    return Injection(distance, pale), pale


def distances() -> NDArray[np.float64]:
    z, y, x = np.meshgrid(Z, Z, Z, indexing="ij")
    away: NDArray[np.float64] = np.sqrt((x - 12.0) ** 2 + (y - 12) ** 2 + (z - 12) ** 2)
    return away


@given(st.floats(0.01, 3.0))
def test_fluid_fills_its_share_of_a_ball(ml: float) -> None:
    ball_mm3 = 4.0 / 3.0 * math.pi * radius_mm(ml) ** 3
    assert ball_mm3 * SHARE == pytest.approx(1000.0 * ml)


@given(st.floats(0.3, 6.0))
def test_a_depot_is_a_ball_as_large_as_what_was_injected(seconds: float) -> None:
    injection, pale = begun(slabs())
    box = injection.inject(MIDDLE, seconds)
    assert injection.ml == pytest.approx(ML_PER_S * seconds)
    assert box is not None
    away, radius = distances(), radius_mm(ML_PER_S * seconds)
    assert not pale[away >= radius].any()
    # of what is not drawn yet the ball is smaller
    drawn = radius_mm(ML_PER_S * seconds - DRAWN_ML)
    assert (pale[away < drawn - EDGE_MM] == 255).all()
    k, j, i = np.nonzero(pale)
    for axis, places in enumerate((i, j, k)):
        assert box[0][axis] <= places.min()
        assert box[1][axis] >= places.max()


def test_it_does_not_cross_air() -> None:
    injection, pale = begun(slabs(gap_mm=3.0))
    injection.inject(MIDDLE, 3.0)
    assert radius_mm(3.0 * ML_PER_S) > 6.0
    # 2 mm below the slit, which is 3 mm wide
    assert pale[Z < 14.0].any()
    assert not pale[Z > 16.5].any()


def test_what_flows_into_air_runs_off() -> None:
    injection, pale = begun(slabs(gap_mm=3.0))
    assert injection.inject(np.array([12.0, 12.0, 15.5]), 3.0) is None
    assert injection.ml == 0.0
    assert not pale.any()


@given(st.integers(1, 40))
@settings(max_examples=12)
def test_it_does_not_matter_how_often_it_is_looked_at(count: int) -> None:
    injection, pale = begun(slabs())
    whole, once = begun(slabs())
    for _ in range(count):
        injection.inject(MIDDLE, 2.0 / count)
    whole.inject(MIDDLE, 2.0)
    assert injection.ml == pytest.approx(whole.ml)
    assert len(injection.depots) == 1
    assert np.array_equal(pale, once)


def test_another_place_is_another_depot_and_pallor_never_falls() -> None:
    injection, pale = begun(slabs())
    injection.inject(MIDDLE, 1.5)
    before = pale.copy()
    injection.inject(MIDDLE + np.array([4.0, 0.0, 0.0]), 1.5)
    assert len(injection.depots) == 2
    assert (pale >= before).all()
    assert (pale > before).any()


@settings(max_examples=12)
@given(st.lists(st.tuples(st.integers(0, 5), st.floats(0.1, 1.0)), max_size=6))
def test_a_frozen_injection_comes_back_to_the_bit(
    steps: list[tuple[int, float]],
) -> None:
    injection, pale = begun(slabs())
    states = [(injection.checkpoint(), pale.copy())]
    for place, seconds in steps:
        injection.inject(MIDDLE + np.array([float(place), 0.0, 0.0]), seconds)
        states.append((injection.checkpoint(), pale.copy()))
    for state, then in (*reversed(states), *states):
        now = pale.copy()
        box = injection.restore(state)
        assert np.array_equal(pale, then)
        assert injection.depots == state.depots
        differs = np.argwhere(now != then)[:, ::-1]
        if len(differs):
            assert box is not None
            assert (differs >= box[0]).all()
            assert (differs <= box[1]).all()


def test_pallor_of_another_grid_is_refused() -> None:
    with pytest.raises(UserError, match="pallor must be uint8"):
        Injection(slabs(), np.zeros((3, 3, 3), np.uint8))
