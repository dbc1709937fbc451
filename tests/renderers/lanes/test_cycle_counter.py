from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.lanes.cycle_counter import passed, ticks


@njit(nogil=True)
def watch(n: int) -> Any:
    first = ticks()
    total = 0.0
    for k in range(n):
        total += np.sqrt(float(k))
    return first, ticks(), total


@njit(nogil=True)
def stages(spent: NDArray[np.int64], n: int) -> Any:
    now = ticks()
    begun = now
    for k in range(n):
        now = passed(spent, k % 3, now)
    return now - begun


def test_work_takes_ticks_and_more_work_more() -> None:
    """By a factor that no hold-up can turn round: a thousand times the work."""
    first, last, _ = watch(1_000)
    assert last - first > 0
    shortest = min(b - a for a, b, _ in (watch(100) for _ in range(50)))
    a, b, _ = watch(1_000_000)
    assert b - a > shortest


def test_stages_add_up_to_all_that_passed() -> None:
    spent = np.zeros(3, np.int64)
    whole = stages(spent, 300)
    assert whole > 0
    assert spent.sum() == whole
    assert np.all(spent >= 0)
