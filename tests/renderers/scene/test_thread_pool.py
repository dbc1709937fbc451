import gc
import threading
import time
from functools import partial
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from renderers.scene import thread_pool
from renderers.scene.thread_pool import ThreadPool, _Board
from renderers.simd.atomics import count_up


@pytest.mark.parametrize("threads", [1, 2, 5])
def test_every_part_is_done_once_and_results_keep_their_order(threads: int) -> None:
    pool = ThreadPool(threads)
    done: list[int] = []

    def work(part: int) -> int:
        done.append(part)
        return part * part

    for count in (0, 1, 3, 100):
        done.clear()
        assert pool.map(work, range(count)) == [n * n for n in range(count)]
        assert sorted(done) == list(range(count))
    pool.close()


def test_parts_run_at_the_same_time() -> None:
    """Three parts that wait for each other end only when three threads run them."""
    together = threading.Barrier(3, timeout=30)
    pool = ThreadPool(3)
    assert len(set(pool.map(lambda _: together.wait(), range(3)))) == 3
    pool.close()


def test_an_error_in_a_part_reaches_the_caller() -> None:
    pool = ThreadPool(2)

    def work(part: int) -> int:
        if part == 7:
            raise ArithmeticError(part)
        return part

    with pytest.raises(ArithmeticError, match="7"):
        pool.map(work, range(20))
    assert pool.map(work, range(5)) == list(range(5))
    pool.close()


def test_threads_must_be_positive() -> None:
    with pytest.raises(ValueError, match="at least one thread"):
        ThreadPool(0)


def test_a_pool_at_work_leaves_others_to_themselves() -> None:
    """Another thread, and a part that asks for more parts."""
    pool = ThreadPool(2)

    def more(part: int) -> list[int]:
        return pool.map(abs, range(-part, 1))

    assert pool.map(more, range(9)) == [list(range(n, -1, -1)) for n in range(9)]
    found: list[list[list[int]]] = []
    others = [
        threading.Thread(target=lambda: found.append(pool.map(more, range(50))))
        for _ in range(3)
    ]
    for other in others:
        other.start()
    for other in others:
        other.join(timeout=60)
    assert found == [[list(range(n, -1, -1)) for n in range(50)]] * 3
    pool.close()


def test_threads_end_with_their_pool_and_sleep_between_maps() -> None:
    before = threading.active_count()
    pool = ThreadPool(3)
    together = threading.Barrier(3, timeout=30)
    for pause_s in (0.0, 0.05):
        # awake or asleep, they come
        time.sleep(pause_s)
        assert len(pool.map(lambda _: together.wait(), range(3))) == 3
    assert threading.active_count() == before + 2
    helpers = [t for t in threading.enumerate() if t.name == "pool"][-2:]
    del pool
    gc.collect()
    for helper in helpers:
        helper.join(timeout=30)
        assert not helper.is_alive()


@pytest.mark.parametrize("is_awake", [True, False])
def test_a_pool_may_end_in_a_thread_that_has_its_lock(
    is_awake: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Memory is freed wherever some is asked for; helpers may be about to take it."""
    if is_awake:
        monkeypatch.setattr(thread_pool, "LOOKS", 10**9)
    pool = ThreadPool(2)
    board = pool._board
    assert pool.map(abs, range(3)) == [0, 1, 2]
    ended = threading.Event()

    def end() -> None:
        with board._changed:
            if is_awake:
                # the helper begins to look for work, and waits for the lock
                count_up(board.calls)
                time.sleep(0.05)
            board.end()
        ended.set()

    time.sleep(0.05)
    threading.Thread(target=end, daemon=True).start()
    assert ended.wait(30)
    pool._helpers[0].join(timeout=30)
    assert not pool._helpers[0].is_alive()


def test_who_is_interrupted_at_the_end_of_a_map_waits_all_the_same(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """What the others write to is the caller's again when the map has ended."""
    pool = ThreadPool(2)
    wait, interrupts = _Board.wait, iter([KeyboardInterrupt()])
    caller = threading.get_ident()

    is_interrupted = threading.Event()

    def interrupted(board: _Board, shared: NDArray[np.int64], value: int) -> None:
        if threading.get_ident() == caller and (error := next(interrupts, None)):
            is_interrupted.set()
            raise error
        wait(board, shared, value)

    monkeypatch.setattr(_Board, "wait", interrupted)
    both = threading.Barrier(2, timeout=30)
    ended: list[int] = []

    def work(part: int) -> int:
        both.wait()
        if threading.get_ident() != caller:
            assert is_interrupted.wait(30)
            time.sleep(0.1)
            ended.append(part)
        return threading.get_ident()

    with pytest.raises(KeyboardInterrupt):
        pool.map(work, range(2))
    assert len(ended) == 1
    assert pool.busy[0] == 0
    assert len(set(pool.map(work, range(2)))) == 2
    pool.close()


def test_after_closing_the_caller_works_alone() -> None:
    pool = ThreadPool(2)
    assert pool.map(abs, range(4)) == [0, 1, 2, 3]
    pool.close()
    mine = threading.get_ident()
    assert pool.map(lambda _: threading.get_ident(), range(4)) == [mine] * 4


def test_a_pool_may_be_passed_on() -> None:
    with_two = ThreadPool.of(2)
    assert with_two.threads == 2
    assert ThreadPool.of(with_two) is with_two
    with_two.close()


@pytest.mark.parametrize("threads", [1, 2, 3])
def test_futures_are_done_once_each_beside_maps(threads: int) -> None:
    pool = ThreadPool(threads)
    done: list[int] = []

    def work(number: int) -> int:
        done.append(number)
        return -number

    for number in range(200):
        future = pool.start(partial(work, number))
        assert pool.map(abs, range(-5, 0)) == [5, 4, 3, 2, 1]
        assert future.result() == future.result() == -number
    several = [pool.start(partial(work, number)) for number in range(200, 230)]
    assert [future.result() for future in several] == [-n for n in range(200, 230)]
    assert sorted(done) == list(range(230))
    pool.close()


def test_a_future_runs_while_the_caller_maps_alone() -> None:
    """It waits for the map that it would hold up if it were done first."""
    pool = ThreadPool(2)
    go = threading.Event()
    done: list[bool] = []
    future = pool.start(lambda: done.append(go.wait(30)))
    assert pool.map(abs, range(-3, 0)) == [3, 2, 1]
    assert not done
    go.set()
    future.result()
    assert done == [True]
    # whoever did it is there for maps again
    together = threading.Barrier(2, timeout=30)
    assert sorted(pool.map(lambda _: together.wait(), range(2))) == [0, 1]
    pool.close()


def test_a_futures_error_is_raised_where_its_result_is_asked_for() -> None:
    for threads in (1, 2):
        pool = ThreadPool(threads)
        future = pool.start(partial(divmod, 1, 0))
        assert pool.map(abs, range(3)) == [0, 1, 2]
        with pytest.raises(ZeroDivisionError):
            future.result()
        pool.close()


def test_who_asks_for_a_future_that_nobody_began_does_it() -> None:
    pool = ThreadPool(2)
    busy = threading.Event()
    first = pool.start(partial(busy.wait, 30))
    second = pool.start(threading.get_ident)
    assert second.result() == threading.get_ident()
    busy.set()
    assert first.result()
    pool.close()
    assert pool.start(threading.get_ident).result() == threading.get_ident()


@pytest.mark.parametrize("threads", [1, 3])
def test_rousing_does_nothing_but_wake(threads: int) -> None:
    """Before any work, again and again, asleep or not, and after the end."""
    pool = ThreadPool(threads)
    for _ in range(3):
        pool.rouse()
        pool.rouse()
        assert pool.map(str, range(5)) == list("01234")
        time.sleep(0.002)
        pool.rouse()
        future = pool.start(lambda: 7)
        pool.rouse()
        assert future.result() == 7
    pool.close()
    pool.rouse()
    assert pool.map(str, range(3)) == list("012")


def test_a_caller_that_fell_asleep_is_woken_by_the_last_to_end() -> None:
    pool = ThreadPool(3)
    for pause_s in (0.0, 0.001, 0.02):
        begun = threading.Barrier(3, timeout=30)

        def work(part: int, pause_s: float = pause_s, of: Any = begun) -> None:
            of.wait()
            # the caller ends first, and has looked around enough by then
            time.sleep(pause_s if threading.current_thread().name == "pool" else 0)

        for _ in range(20):
            pool.map(work, range(3))
        assert pool.busy[0] == 0
    pool.close()
