"""Doors open by skill, not by luck."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import binom

from scenarios import Scenario
from scenarios.ladder import (
    CONFIDENCE,
    LAST_RUNS,
    LEAST_RATE,
    ExerciseStatus,
    false_unlock,
    is_mastered,
    lower_bound,
    rungs,
)


@given(st.integers(1, 30), st.data())
def test_the_bound_is_the_rate_at_which_so_many_passes_are_luck(
    runs: int, data: st.DataObject
) -> None:
    passes = data.draw(st.integers(1, runs))
    bound = lower_bound(passes, runs)
    assert binom.sf(passes - 1, runs, bound) == pytest.approx(1.0 - CONFIDENCE)
    # with every run passed, it has a closed form
    closed = (1.0 - CONFIDENCE) ** (1.0 / runs)
    assert lower_bound(runs, runs) == pytest.approx(closed)
    assert lower_bound(0, runs) == 0.0


def test_three_in_a_row_or_five_of_six() -> None:
    assert not is_mastered([])
    assert not is_mastered([True])
    assert not is_mastered([True, True])
    assert is_mastered([True, True, True])
    assert is_mastered([True, True, False, True, True, True])
    assert not is_mastered([True, True, False, True, False, True])
    # what was long ago does not count
    assert not is_mastered([True] * 20 + [False] * LAST_RUNS)
    assert is_mastered([False] * 20 + [True] * LAST_RUNS)


@pytest.mark.parametrize("rate", [0.0, 0.2, 0.3, 0.5, 1.0])
def test_luck_opens_as_seldom_as_is_said(rate: float) -> None:
    # until the third run only three passes in a row open
    assert false_unlock(rate, 2) == 0.0
    assert false_unlock(rate, 3) == pytest.approx(rate**3)
    # of four: the first three, or all, which the first three include
    assert false_unlock(rate, 4) == pytest.approx(rate**3)
    assert false_unlock(rate, 10) <= false_unlock(rate, 20) + 1e-12


def test_one_look_errs_no_more_often_than_confidence_allows() -> None:
    for runs in range(1, LAST_RUNS + 1):
        enough = [
            k for k in range(runs + 1) if is_mastered([True] * k + [False] * (runs - k))
        ]
        chance = math.fsum(binom.pmf(k, runs, LEAST_RATE) for k in enough)
        assert chance <= 1.0 - CONFIDENCE


def test_a_rung_waits_for_those_below() -> None:
    first = Scenario("first", "First")
    second = Scenario("second", "Second", needs=("first",))
    locked = rungs([first, second], {"first": [True, True]})
    assert [rung.door for rung in locked] == [
        ExerciseStatus.OPEN,
        ExerciseStatus.LOCKED,
    ]
    assert locked[1].waits == ("first",)
    opened = rungs([first, second], {"first": [True] * 3})
    assert [rung.door for rung in opened] == [
        ExerciseStatus.PASSED,
        ExerciseStatus.OPEN,
    ]
    assert opened[0].passes == opened[0].runs == 3
