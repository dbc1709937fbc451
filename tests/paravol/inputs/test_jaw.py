import pytest
from hypothesis import given
from hypothesis import strategies as st

from paravol.inputs.jaw import CLOSING_S, OPENING_S, Jaw

steps = st.lists(st.floats(1e-4, 0.1), min_size=1, max_size=40)


@given(steps, steps)
def test_a_jaw_moves_in_time_however_often_it_is_asked(
    pressed: list[float], released: list[float]
) -> None:
    jaw = Jaw()
    assert jaw.at(3.0, True) == 0.0
    time_s = 3.0
    for step in pressed:
        time_s += step
        closed = jaw.at(time_s, True)
    assert closed == pytest.approx(min(sum(pressed) / CLOSING_S, 1.0))
    for step in released:
        time_s += step
        left = jaw.at(time_s, False)
    assert left == pytest.approx(max(closed - sum(released) / OPENING_S, 0.0))


def test_time_that_goes_back_moves_nothing() -> None:
    jaw = Jaw()
    jaw.at(1.0, True)
    before = jaw.at(1.1, True)
    assert jaw.at(0.5, True) == before
    assert jaw.at(0.4, False) == before
