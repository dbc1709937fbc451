import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from scenarios.metrics.episodes import held, intervals, stretches, weights

STATES = st.lists(st.booleans(), max_size=40)


@given(st.lists(st.tuples(st.booleans(), st.booleans()), max_size=40))
def test_a_switch_stays_until_it_is_turned(pairs: list[tuple[bool, bool]]) -> None:
    opens = np.array([a for a, _ in pairs], bool)
    closes = np.array([b for _, b in pairs], bool)
    state, expected = False, []
    for is_open, is_close in pairs:
        state = is_open or (state and not is_close)
        expected.append(state)
    assert held(opens, closes).tolist() == expected


@given(STATES)
def test_stretches_cover_what_is_on(states: list[bool]) -> None:
    covered = [False] * len(states)
    for begin, end in stretches(np.array(states, bool)):
        assert begin < end
        covered[begin:end] = [True] * (end - begin)
    assert covered == states


@given(STATES)
def test_times_on_and_off_add_up(states: list[bool]) -> None:
    times = np.cumsum(np.linspace(0.01, 0.9, len(states)))
    state = np.array(states, bool)
    whole = weights(times, 0.5).sum()
    spent = [
        sum(end - begin for begin, end in intervals(times, part, 0.5))
        for part in (state, ~state)
    ]
    assert np.isclose(sum(spent), whole)


def test_nothing_lasts_over_a_gap() -> None:
    times = np.array([0.0, 0.1, 5.0, 5.1])
    assert np.allclose(weights(times, 0.5), [0.1, 0.0, 0.1, 0.0])
    on = np.ones(4, bool)
    assert np.allclose(intervals(times, on, 0.5), [(0.0, 0.1), (5.0, 5.1)])
