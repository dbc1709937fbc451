"""Points by their definition, and their spread against its integral."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scenarios.rubrics.points import percent_of, percent_sigma

KNOTS = ((1.0, 100.0), (3.0, 40.0), (7.0, 0.0))
RISING = ((-2.0, 0.0), (5.0, 100.0))


def test_points_are_straight_between_knots_and_level_beyond() -> None:
    for value, percent in ((-9.0, 100), (1, 100), (2, 70), (3, 40), (5, 20), (99, 0)):
        assert percent_of(KNOTS, float(value)) == pytest.approx(percent)


@given(st.floats(-20, 20), st.floats(-20, 20))
def test_falling_knots_never_rise(first: float, second: float) -> None:
    low, high = sorted((first, second))
    assert percent_of(KNOTS, low) >= percent_of(KNOTS, high)
    assert 0.0 <= percent_of(KNOTS, low) <= 100.0


def test_far_from_knots_the_spread_is_the_slope_times_sigma() -> None:
    assert percent_sigma(RISING, 1.5, 0.01) == pytest.approx(0.01 * 100 / 7, rel=1e-6)
    assert percent_sigma(RISING, 50.0, 0.1) == 0.0
    assert percent_sigma(KNOTS, 2.0, 0.0) == 0.0


def test_a_wide_value_is_a_coin() -> None:
    """Far wider than the knots, it gives all points or none: a deviation of 50."""
    assert percent_sigma(RISING, 1.5, 1e4) == pytest.approx(50.0, rel=1e-3)


@pytest.mark.parametrize("value", [0.5, 1.0, 2.9, 6.0, 9.0])
@pytest.mark.parametrize("sigma", [0.05, 0.8, 4.0])
def test_the_spread_is_that_of_the_integral(value: float, sigma: float) -> None:
    normal = np.linspace(-9.0, 9.0, 400_001)
    weight = np.exp(-(normal**2) / 2)
    values, percents = zip(*KNOTS, strict=True)
    given_percent = np.interp(value + sigma * normal, values, percents)
    mean = np.average(given_percent, weights=weight)
    spread = np.sqrt(np.average((given_percent - mean) ** 2, weights=weight))
    assert percent_sigma(KNOTS, value, sigma) == pytest.approx(spread, rel=1e-6)
