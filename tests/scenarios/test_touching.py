import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scenarios.touching import Touches


@given(st.lists(st.integers(1, 30), min_size=1, max_size=6), st.integers(0, 9))
def test_every_press_is_one_point_at_its_mean(holds: list[int], seed: int) -> None:
    random = np.random.default_rng(seed)
    touches = Touches(len(holds))
    expected = []
    for hold in holds:
        center = random.uniform(-50, 50, 3)
        samples = center + random.normal(0, 0.05, (hold, 3))
        for sample in samples:
            assert not touches.add(sample, 1)
        assert touches.add(center + 30, 0)
        assert not touches.add(center + 31, 2)  # the other pedal is no touch
        expected.append(samples.mean(axis=0))
    assert touches.is_complete
    assert np.allclose(touches.points_mm, expected)


def test_a_sliding_touch_is_refused() -> None:
    touches = Touches(1)
    for i in range(20):
        touches.add(np.array([i * 0.5, 0.0, 0.0]), 1)
    assert not touches.add(np.zeros(3), 0)
    assert touches.refused == 1
    assert touches.points_mm == []


@pytest.mark.parametrize("wanted", [1, 4])
def test_incomplete_until_all_are_touched(wanted: int) -> None:
    touches = Touches(wanted)
    for i in range(wanted):
        assert not touches.is_complete
        touches.add(np.full(3, float(i)), 1)
        touches.add(np.zeros(3), 0)
    assert touches.is_complete
