"""Curves find the laws that made-up learners follow, and how sure they are."""

import numpy as np
import pytest
from scipy.stats import binomtest

from paravol.progress.learning_curve import (
    LearningCurve,
    Shape,
    fit_learning_curve,
    moving_pass_rate,
)


def learner(
    shape: Shape, plateau: float, gain: float, rate: float, count: int
) -> list[float]:
    """Practise without noise."""
    n = np.arange(1.0, count + 1.0)
    falls = n**-rate if shape is Shape.POWER else np.exp(-rate * (n - 1.0))
    return list(plateau + gain * falls)


def fitted(figures: list[float], **options: int) -> LearningCurve:
    curve = fit_learning_curve(figures, **options)
    assert isinstance(curve, LearningCurve)
    return curve


@pytest.mark.parametrize("shape", list(Shape))
@pytest.mark.parametrize(("gain", "rate"), [(80.0, 0.7), (-40.0, 1.3), (25.0, 0.15)])
def test_a_noiseless_learner_is_found_again(
    shape: Shape, gain: float, rate: float
) -> None:
    curve = fitted(learner(shape, 60.0, gain, rate, 14))
    assert curve.shape is shape
    assert curve.rate == pytest.approx(rate, rel=1e-5)
    assert curve.plateau == pytest.approx(60.0, rel=1e-5)
    assert curve.gain == pytest.approx(gain, rel=1e-5)
    expected = learner(shape, 60.0, gain, rate, 15)
    np.testing.assert_allclose(curve.middle, expected, rtol=1e-7)
    assert curve.spread < 1e-4


def test_a_learner_who_does_not_change_has_a_flat_curve() -> None:
    curve = fitted([7.0] * 6)
    assert (curve.middle == 7.0).all()
    assert (curve.low == 7.0).all()
    assert (curve.high == 7.0).all()


def test_the_band_holds_the_truth_as_often_as_it_says() -> None:
    """90 %: over many learners between 80 and 99 %, so neither narrow nor empty."""
    random = np.random.default_rng(3)
    truth = np.array(learner(Shape.POWER, 60.0, 80.0, 0.7, 17))
    held = []
    for _ in range(30):
        measured = truth[:16] + random.normal(scale=6.0, size=16)
        curve = fitted(list(measured), draws=200)
        held.append(((curve.low <= truth) & (truth <= curve.high)).mean())
        assert (curve.low <= curve.middle).all()
        assert (curve.middle <= curve.high).all()
    assert 0.80 < np.mean(held) < 0.99


def test_the_same_figures_give_the_same_bits() -> None:
    figures = [90.0, 70.0, 74.0, 60.0, 61.0]
    one, two = fitted(figures), fitted(figures)
    assert one.low.tobytes() == two.low.tobytes()
    assert one.high.tobytes() == two.high.tobytes()
    other = fitted(figures, seed=1)
    assert other.low.tobytes() != one.low.tobytes()


def test_units_only_scale_the_curve() -> None:
    figures = [90.0, 70.0, 74.0, 60.0, 61.0]
    curve = fitted(figures)
    scaled = fitted([1000.0 * f + 5.0 for f in figures])
    np.testing.assert_allclose(scaled.middle, 1000.0 * curve.middle + 5.0, rtol=1e-6)


def test_too_few_attempts_are_told() -> None:
    for count in range(4):
        assert fit_learning_curve([1.0] * count) == (
            f"not enough data: 4 attempts are needed, there are {count}"
        )
    assert "finite" in str(fit_learning_curve([1.0, 2.0, float("nan"), 3.0]))


def test_the_moving_pass_rate_is_wilsons() -> None:
    passed = [False, False, True, True, True, True]
    rates = moving_pass_rate(passed)
    assert [(r.attempt, r.share) for r in rates] == [(5, 0.6), (6, 0.8)]
    # Wilson's interval in closed form
    z, n, p = 1.6448536269514722, 5, 0.6
    middle = (p + z * z / (2 * n)) / (1 + z * z / n)
    half = z / (1 + z * z / n) * np.sqrt(p * (1 - p) / n + z * z / (4 * n * n))
    assert rates[0].low == pytest.approx(middle - half)
    assert rates[0].high == pytest.approx(middle + half)
    assert binomtest(3, 5).proportion_ci(0.9, "wilson").low == rates[0].low
    assert moving_pass_rate([True] * 4) == []
