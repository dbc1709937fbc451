"""Sleep costs wall time and no CPU; work costs both; the first call is dropped."""

import time
from collections.abc import Iterator
from itertools import count

import pytest

from benchmarks.timing import Timing, measure

SLEEP_S = 0.02


def test_sleep_is_seen_by_the_wall_clock_only() -> None:
    timing, _ = measure(lambda: time.sleep(SLEEP_S), budget_s=0.0, least=3)
    assert timing.min_s >= SLEEP_S
    assert timing.cpu_s < SLEEP_S / 2
    assert timing.repeats == 3


def test_work_is_seen_by_both() -> None:
    def work() -> None:
        end = time.thread_time() + SLEEP_S
        while time.thread_time() < end:
            pass

    timing, _ = measure(work, budget_s=0.0, cpu_clock=time.thread_time)
    assert timing.cpu_s >= SLEEP_S
    assert timing.min_s >= 0.9 * timing.cpu_s


def test_the_first_call_is_dropped_and_the_last_result_given() -> None:
    numbers: Iterator[int] = count()
    timing, last = measure(lambda: next(numbers), budget_s=0.0, least=4)
    assert (timing.repeats, last) == (4, 4)
    numbers = count()
    timing, last = measure(lambda: next(numbers), least=1, most=1, warm_up=False)
    assert (timing.repeats, last) == (1, 0)


def test_repeats_stay_within_budget_and_bounds() -> None:
    quick, _ = measure(lambda: None, budget_s=10.0, most=6)
    assert quick.repeats == 6
    slow, _ = measure(lambda: time.sleep(SLEEP_S), budget_s=5 * SLEEP_S, least=1)
    assert 1 <= slow.repeats <= 5


def test_minimum_and_median() -> None:
    assert Timing.of([3.0, 1.0, 2.0], [0.5, 0.4, 0.6]) == Timing(1.0, 2.0, 0.4, 3)


@pytest.mark.parametrize(("least", "most"), [(0, 3), (4, 3)])
def test_nonsense_repeats_are_refused(least: int, most: int) -> None:
    with pytest.raises(ValueError, match="least <= most"):
        measure(lambda: None, least=least, most=most)
