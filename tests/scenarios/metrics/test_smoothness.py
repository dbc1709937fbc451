import math

import numpy as np
import pytest
from numpy.typing import NDArray

from scenarios.metrics.metric import SCOPE
from scenarios.metrics.smoothness import (
    ldlj_of_position,
    ldlj_of_speed,
    movement_count,
    movements,
    root_squared_jerk,
    sparc,
)
from tests.scenarios.metrics.tracks import minimum_jerk, of_scope, track

MINIMUM_JERK = -math.log(720 / 1.875**2)
RATE = 100.0


def gaussian() -> NDArray[np.float64]:
    return np.asarray(np.exp(-5 * np.arange(-1.0, 1.0, 0.01) ** 2))


def least_jerk_speed(rate_hz: float) -> NDArray[np.float64]:
    s = np.arange(round(rate_hz) + 1) / rate_hz
    return np.asarray(30 * s**2 - 60 * s**3 + 30 * s**4)


def test_the_authors_example() -> None:
    value = ldlj_of_speed(gaussian(), RATE)
    assert value is not None
    assert value == pytest.approx(-5.81636, abs=5e-6)
    assert -math.exp(-value) == pytest.approx(-335.747, abs=5e-4)
    assert sparc(gaussian(), RATE) == pytest.approx(-1.41403, abs=5e-6)


@pytest.mark.parametrize(
    ("rate_hz", "speed_form", "vector_form"),
    [(100, -5.3016, -5.223), (1000, -5.3200, -5.312), (10_000, -5.3218, -5.3210)],
)
def test_both_forms_converge_to_the_reach_of_least_jerk(
    rate_hz: int, speed_form: float, vector_form: float
) -> None:
    assert round(MINIMUM_JERK, 5) == -5.32203
    _, tip = minimum_jerk(rate_hz)
    speed = ldlj_of_speed(least_jerk_speed(rate_hz), rate_hz)
    vector = ldlj_of_position(tip, rate_hz)
    assert speed == pytest.approx(speed_form, abs=1e-4)
    assert vector == pytest.approx(vector_form, abs=5e-4)


@pytest.mark.parametrize("form", ["speed", "vector"])
def test_the_limit_is_the_analytic_value(form: str) -> None:
    """Errors fall by the first order of the step: extrapolated, five digits hold."""

    def value(rate_hz: int) -> float:
        if form == "speed":
            found = ldlj_of_speed(least_jerk_speed(rate_hz), rate_hz)
        else:
            found = ldlj_of_position(minimum_jerk(rate_hz)[1], rate_hz)
        assert found is not None
        return found

    # in long double arithmetic this would go on; third differences of doubles end here
    assert 2 * value(2000) - value(1000) == pytest.approx(MINIMUM_JERK, abs=5e-5)


def test_size_and_duration_do_not_count() -> None:
    _, tip = minimum_jerk(RATE)
    value = ldlj_of_position(tip, RATE)
    assert ldlj_of_position(7.0 * tip, RATE) == pytest.approx(value, abs=1e-9)
    assert ldlj_of_position(tip, RATE / 3) == pytest.approx(value, abs=1e-9)
    assert sparc(5.0 * gaussian(), RATE) == pytest.approx(sparc(gaussian(), RATE))


def test_a_circle_has_jerk_in_the_vector_form_only() -> None:
    t = np.arange(0.0, 10.0, 0.01)
    circle = 10 * np.stack([np.cos(t), np.sin(t), 0 * t], axis=1)
    value = ldlj_of_position(circle, RATE)
    assert value == pytest.approx(-9.204, abs=5e-4)
    assert value == pytest.approx(-math.log(1e4), abs=7e-3)
    speed = np.linalg.norm(np.diff(circle, axis=0), axis=1) * RATE
    assert ldlj_of_speed(speed, RATE) is None


def test_sparc_gets_worse_with_every_submovement() -> None:
    s = np.arange(0.0, 1.0, 0.01)
    one = 30 * s**2 - 60 * s**3 + 30 * s**4
    values = [sparc(np.tile(one, n), RATE) for n in (1, 2, 3, 5, 10)]
    assert values == pytest.approx([-1.41, -2.25, -2.70, -3.30, -3.98], abs=0.006)


@pytest.mark.parametrize("count", [0, 1, 2])
def test_too_few_samples_have_no_score(count: int) -> None:
    assert ldlj_of_speed(np.ones(count), RATE) is None
    assert sparc(np.ones(count), RATE) is None
    assert ldlj_of_position(np.ones((count + 1, 3)), RATE) is None


def test_rest_has_no_score() -> None:
    assert ldlj_of_speed(np.zeros(50), RATE) is None
    assert ldlj_of_position(np.zeros((50, 3)), RATE) is None
    assert sparc(np.zeros(50), RATE) is None


@pytest.mark.parametrize("pause_s", [1.0, 5.0, 20.0])
def test_a_pause_between_movements_does_not_count(pause_s: float) -> None:
    _, tip = minimum_jerk(RATE, pause_s)
    there_and_on = np.concatenate([tip, tip[-1] + tip[1:]])
    t = np.arange(len(there_and_on)) / RATE
    measured = of_scope(track(t, there_and_on))
    assert movement_count(measured, SCOPE).value == 2.0
    scores = [
        sparc(piece.speed_mm_s[part], RATE)
        for piece, part, _ in movements(measured, SCOPE)
    ]
    # what lies below the speed of rest is cut off: not the -1.40 of a whole reach
    assert scores == pytest.approx([-1.54, -1.54], abs=0.005)
    (piece,) = measured.scope_pieces
    whole = sparc(piece.speed_mm_s, RATE)
    assert whole is not None
    assert whole < -3.9  # and worse the longer the pause


def test_movements_say_when_they_were() -> None:
    times, tip = minimum_jerk(RATE, 1.0)
    found = movement_count(of_scope(track(times + 5.0, tip)), SCOPE)
    ((begin, end),) = found.intervals
    assert 5.0 <= begin < 5.2
    assert 5.8 < end <= 6.1


def test_root_squared_jerk_of_least_jerk() -> None:
    """sqrt(720 D^2 / T^5) for a reach D in T; the filter takes some of its ends."""
    times, tip = minimum_jerk(RATE)
    value = root_squared_jerk(of_scope(track(times, tip)), SCOPE).value
    assert value == pytest.approx(math.sqrt(720) * 20, rel=0.12)
