"""The pass mark against closed forms and the two densities themselves."""

from statistics import NormalDist

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from scenarios.rubrics.contrasting_groups import GroupFit, crossing, pass_mark
from system import UserError

LOW = [48.0, 50.0, 52.0, 47.0, 53.0]


def test_equal_spreads_part_in_the_middle() -> None:
    assert crossing(GroupFit(9, 10.0, 2.0), GroupFit(9, 20.0, 2.0)) == 15.0


def test_a_known_quadratic() -> None:
    """N(0, 1) and N(3, 2): 3 u^2 + 6 u - 9 - 8 ln 2 = 0."""
    expected = -1.0 + np.sqrt(1.0 + 3.0 + 8.0 / 3.0 * np.log(2.0))
    found = crossing(GroupFit(9, 0.0, 1.0), GroupFit(9, 3.0, 2.0))
    assert found == pytest.approx(expected)


@given(st.floats(-50, 50), st.floats(-50, 50), st.floats(0.1, 30), st.floats(0.1, 30))
def test_the_densities_are_equal_at_the_mark(
    first: float, second: float, narrow: float, wide: float
) -> None:
    assume(abs(first - second) > 0.1)
    mark = crossing(GroupFit(9, first, narrow), GroupFit(9, second, wide))
    if mark is None:
        # then one density is the larger from mean to mean
        between = np.linspace(first, second, 101)
        one, other = NormalDist(first, narrow), NormalDist(second, wide)
        signs = {one.pdf(x) > other.pdf(x) for x in between[1:-1]}
        assert len(signs) == 1
        return
    assert min(first, second) <= mark <= max(first, second)
    density = NormalDist(first, narrow).pdf(mark)
    assume(density > 1e-200)
    assert NormalDist(second, wide).pdf(mark) == pytest.approx(density, rel=1e-4)


def test_shifted_scaled_and_mirrored_groups_have_that_mark() -> None:
    high = [70.0, 66.0, 71.0, 75.0, 69.0]
    mark = pass_mark(LOW, high, draws=200)
    moved = pass_mark([3 * v + 7 for v in LOW], [3 * v + 7 for v in high], draws=200)
    assert moved.mark == pytest.approx(3 * mark.mark + 7)
    assert moved.low == pytest.approx(3 * mark.low + 7)
    mirrored = pass_mark([-v for v in LOW], [-v for v in high], draws=200)
    assert mirrored.mark == pytest.approx(-mark.mark)
    assert (mark.passes_above, mirrored.passes_above) == (True, False)
    assert mirrored.false_pass == pytest.approx(mark.false_pass)


def test_the_interval_covers_the_true_mark_and_narrows() -> None:
    """Of groups N(40, 8) and N(60, 8) the mark is 50."""
    widths = []
    for count in (10, 160):
        inside = 0
        for seed in range(20):
            rng = np.random.default_rng([count, seed])
            low, high = rng.normal(40, 8, count), rng.normal(60, 8, count)
            found = pass_mark(low.tolist(), high.tolist(), draws=200)
            inside += found.low <= 50.0 <= found.high
        assert inside >= 16
        widths.append(found.high - found.low)
    assert widths[1] < 0.5 * widths[0]


@pytest.mark.parametrize(
    ("low", "high", "words"),
    [
        ([1.0, 2.0], LOW, "at least 3 sessions"),
        ([5.0, 5.0, 5.0], LOW, "All 3 novices have the value 5"),
        (LOW, LOW, "cannot be told apart"),
        ([*LOW, float("nan")], LOW, "not finite"),
    ],
)
def test_groups_without_a_mark(low: list[float], high: list[float], words: str) -> None:
    with pytest.raises(UserError, match=words):
        pass_mark(low, high, draws=10)
