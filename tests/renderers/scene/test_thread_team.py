import threading

import pytest

from renderers.scene.thread_team import ThreadTeam


@pytest.mark.parametrize("threads", [1, 2, 5])
def test_every_part_is_done_once_and_results_keep_their_order(threads: int) -> None:
    team = ThreadTeam(threads)
    done: list[int] = []

    def work(part: int) -> int:
        done.append(part)
        return part * part

    for count in (0, 1, 3, 100):
        done.clear()
        assert team.map(work, range(count)) == [n * n for n in range(count)]
        assert sorted(done) == list(range(count))
    team.close()


def test_parts_run_at_the_same_time() -> None:
    """Three parts that wait for each other end only when three threads run them."""
    together = threading.Barrier(3, timeout=30)
    team = ThreadTeam(3)
    assert len(set(team.map(lambda _: together.wait(), range(3)))) == 3
    team.close()


def test_an_error_in_a_part_reaches_the_caller() -> None:
    team = ThreadTeam(2)

    def work(part: int) -> int:
        if part == 7:
            raise ArithmeticError(part)
        return part

    with pytest.raises(ArithmeticError, match="7"):
        team.map(work, range(20))
    assert team.map(work, range(5)) == list(range(5))
    team.close()


def test_threads_must_be_positive() -> None:
    with pytest.raises(ValueError, match="at least one thread"):
        ThreadTeam(0)
