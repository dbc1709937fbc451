"""Powers are found, and their intervals hold the truth as often as they say."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from benchmarks.reporting.growth import CONFIDENCE, fit, sweeps
from benchmarks.schema import Results

AMOUNTS = [1e3, 4e3, 1e4, 5e4, 3e5]


@given(st.floats(-2, 3), st.floats(1e-9, 1e3))
def test_an_exact_power_is_found(exponent: float, factor: float) -> None:
    found = fit(AMOUNTS, [factor * n**exponent for n in AMOUNTS])
    assert found.exponent == pytest.approx(exponent, abs=1e-9)
    assert found.factor == pytest.approx(factor, rel=1e-6)
    assert found.half_width is not None
    assert found.half_width < 1e-6


def test_the_interval_is_that_of_a_linear_regression() -> None:
    seconds = [0.1, 0.5, 0.9, 6.0, 25.0]
    found = fit(AMOUNTS, seconds)
    known = stats.linregress(np.log(AMOUNTS), np.log(seconds))
    assert found.exponent == pytest.approx(known.slope)
    width = stats.t.ppf(0.5 + CONFIDENCE / 2, 3) * known.stderr
    assert found.half_width == pytest.approx(width)


def test_the_interval_holds_the_truth_as_often_as_it_says() -> None:
    rng = np.random.default_rng(7)
    tries, held = 2000, 0
    for _ in range(tries):
        noise = np.exp(0.1 * rng.standard_normal(len(AMOUNTS)))
        found = fit(AMOUNTS, list(np.asarray(AMOUNTS) ** 0.7 * noise))
        assert found.half_width is not None
        held += abs(found.exponent - 0.7) <= found.half_width
    # four standard deviations of so many tries
    slack = 4 * math.sqrt(CONFIDENCE * (1 - CONFIDENCE) / tries)
    assert held / tries == pytest.approx(CONFIDENCE, abs=slack)


def test_two_points_have_no_interval() -> None:
    assert fit([1.0, 10.0], [1.0, 100.0]).half_width is None


@pytest.mark.parametrize(
    ("amounts", "seconds"),
    [([2.0, 2.0], [1.0, 2.0]), ([1.0, 2.0], [0.0, 1.0]), ([-1.0, 2.0], [1.0, 1.0])],
)
def test_no_power_is_refused(amounts: list[float], seconds: list[float]) -> None:
    with pytest.raises(ValueError, match="different positive amounts"):
        fit(amounts, seconds)


def test_a_sweep_gathers_its_rows_from_small_to_large(results: Results) -> None:
    (sweep,) = sweeps(reversed(results.rows))
    assert sweep.amounts == [100, 400, 1600]
    assert sweep.power.exponent == pytest.approx(1.0)
    assert sweeps([sweep.rows[0]]) == []
