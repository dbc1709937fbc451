from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.simd.atomics import count_up, fetch_add, leave_and_wait, wait_for_change


@njit(nogil=True)
def take_many(turns: NDArray[np.int64], taken: NDArray[np.int64]) -> int:
    """Mark the turns taken, each by one more, until there are no more."""
    mine = 0
    while True:
        turn = fetch_add(turns)
        if turn >= taken.shape[0]:
            return mine
        taken[turn] += 1
        mine += 1


def test_every_turn_is_taken_once() -> None:
    turns, taken = np.zeros(1, np.int64), np.zeros(2_000_000, np.int64)
    with ThreadPoolExecutor(3) as pool:
        shares = list(pool.map(take_many, [turns] * 3, [taken] * 3))
    assert sum(shares) == len(taken)
    assert np.all(taken == 1)
    # each asked once too often
    assert turns[0] == len(taken) + 3


def test_waiting_ends_when_the_number_is_another_or_when_it_has_looked_enough() -> None:
    shared = np.zeros(1, np.int64)
    assert not wait_for_change(shared, 0, 1000)
    assert wait_for_change(shared, 1, 1000)
    with ThreadPoolExecutor(1) as pool:
        waiting = pool.submit(wait_for_change, shared, 0, 10**9)
        shared[0] = 5
        assert waiting.result(timeout=60)


def test_no_one_who_joins_or_leaves_is_lost() -> None:
    """With and without the interpreter's lock, at the same time."""
    busy, bell = np.full(1, 100_000, np.int64), np.zeros(1, np.int64)

    def join(_: int) -> None:
        for _ in range(50_000):
            count_up(busy)

    def leave(_: int) -> None:
        for _ in range(50_000):
            assert not leave_and_wait(busy, bell, 0, 0)

    with ThreadPoolExecutor(4) as pool:
        list(pool.map(lambda do: do(0), [join, leave, leave, join]))
    assert busy[0] == 100_000
