import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices.microscribe.driver.clock_alignment import LARGEST_DRIFT, ClockAlignment

TICK_S = 1.0 / 900.0


def _ride(
    drift: float, delays_s: list[float], start_s: float = 1000.0, step: int = 9
) -> tuple[np.ndarray, np.ndarray, ClockAlignment]:
    """Aligned and true host times of ticks whose packets come with these delays."""
    alignment = ClockAlignment()
    aligned, true = [], []
    for i, delay in enumerate(delays_s):
        ticks = 100 + step * i
        at = start_s + (1.0 + drift) * step * i * TICK_S
        aligned.append(alignment.observe(ticks, at + delay))
        true.append(at)
    return np.array(aligned), np.array(true), alignment


@pytest.mark.parametrize("drift", [0.0, 1e-4, -1e-4])
def test_the_drift_of_two_quartzes_is_found(drift: float) -> None:
    noise = np.random.default_rng(4).exponential(0.002, 9000)
    aligned, true, alignment = _ride(drift, noise.tolist())
    assert alignment.drift == pytest.approx(drift, abs=5e-6)
    # Half a tick is added, since ticks are rounded down; never more than the delay.
    error = aligned[3000:] - true[3000:]
    assert error.min() > -0.0001
    assert error.max() < TICK_S / 2.0 + 0.0004


def test_bursts_and_stalls_are_not_in_the_times() -> None:
    rng = np.random.default_rng(5)
    delays = rng.uniform(0.0, 0.016, 6000)
    delays[2000:2100] += 3.0 - np.arange(100) * 0.01
    aligned, true, _ = _ride(2e-5, delays.tolist())
    error = aligned[1000:] - true[1000:]
    assert error.min() > -0.001
    assert error.max() < 0.002


@given(st.lists(st.floats(0.0, 0.05), min_size=2, max_size=300), st.floats(-1e-4, 1e-4))
def test_times_never_run_backwards_nor_lie_in_the_future(
    delays: list[float], drift: float
) -> None:
    aligned, true, _ = _ride(drift, delays)
    assert (np.diff(aligned) >= 0.0).all()
    # In order of arrival: what was held up holds up what comes behind.
    arrived = np.maximum.accumulate(true + np.array(delays))
    assert (aligned <= arrived + 1e-9).all()


def test_a_mistaken_drift_is_bounded() -> None:
    _, _, alignment = _ride(0.01, [0.0] * 6000)
    assert alignment.drift == LARGEST_DRIFT


def test_a_tick_before_its_time_is_seen() -> None:
    _, true, alignment = _ride(0.0, [0.003] * 1000)
    assert alignment.settled
    ticks = 100 + 9 * 1000
    now = true[-1] + 0.013
    assert alignment.earliness(ticks, now) == pytest.approx(0.0, abs=1e-6)
    assert alignment.earliness(ticks + 90, now) == pytest.approx(0.1, abs=1e-6)
    alignment.forget()
    assert alignment.earliness(ticks + 90, now) == 0.0
    assert not alignment.settled
