"""Work beside the rest: waited for, its error raised, given up when told so."""

import threading

import pytest

from paravol.flight.preparation import Preparation


def test_it_goes_on_beside_and_is_done_after_the_wait() -> None:
    here, there = threading.Event(), threading.Event()
    done = []

    def work() -> None:
        here.set()
        assert there.wait(20.0)
        done.append(threading.current_thread())

    prepared = Preparation(work)
    assert here.wait(20.0)
    there.set()
    prepared.wait(lambda: None)
    assert done
    assert done[0] is not threading.current_thread()


def test_an_error_of_the_work_is_raised_by_the_wait() -> None:
    def work() -> None:
        raise LookupError("no head")

    with pytest.raises(LookupError, match="no head"):
        Preparation(work).wait(lambda: None)


def test_whoever_no_longer_wants_it_need_not_wait_for_its_end() -> None:
    end = threading.Event()

    def give_up() -> None:
        raise KeyError("closed")

    prepared = Preparation(lambda: end.wait(20.0))
    with pytest.raises(KeyError, match="closed"):
        prepared.wait(give_up)
    end.set()
    prepared.wait(lambda: None)
