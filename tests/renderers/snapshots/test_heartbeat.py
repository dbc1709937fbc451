import threading
from collections.abc import Callable
from pathlib import Path

import pytest

from renderers.snapshots.heartbeat import Heartbeat
from renderers.snapshots.spool import JobState, JobStatus, Spool

JOB = "ab" * 16
PATIENCE_S = 30.0


@pytest.fixture
def spool(tmp_path: Path) -> Spool:
    spool = Spool(tmp_path / "spool")
    spool.job_folder(JOB).mkdir()
    spool.begin_attempt(JOB, 1)
    return spool


def wait_for(what: Callable[[], bool]) -> None:
    """Wait until something holds that the heart's own thread brings about."""
    for _ in range(round(PATIENCE_S / 0.01)):
        if what():
            return
        threading.Event().wait(0.01)
    raise AssertionError(f"nothing came of it within {PATIENCE_S:g} s")


def test_a_busy_worker_is_alive_and_tells_its_share(spool: Spool) -> None:
    with Heartbeat(spool, JOB, 1) as heart:
        heart.done = 0.25
        wait_for(lambda: spool.status(JOB).done == 0.25)
        heart.done = 0.5
        wait_for(lambda: spool.status(JOB).done == 0.5)
        assert spool.status(JOB).heartbeat >= 2
        assert heart.may_go_on()
    assert not heart.is_over


def test_a_client_that_cancels_is_told_while_the_worker_is_busy(spool: Spool) -> None:
    with Heartbeat(spool, JOB, 1) as heart:
        spool.ask_cancel(JOB)
        wait_for(lambda: spool.status(JOB).state is JobState.CANCELLED)
        # The client may hear of it a moment before the worker's own thread does.
        wait_for(lambda: not heart.may_go_on())
        # The picture was finished nevertheless: the client has been told otherwise.
        heart.end(JobState.DONE)
    assert spool.status(JOB).state is JobState.CANCELLED


def test_late_jobs_fail_for_the_first_limit_that_was_passed(spool: Spool) -> None:
    with Heartbeat(spool, JOB, 1) as heart:
        heart.limit(3600.0, "much later")
        heart.limit(-1.0, "too late")
        wait_for(lambda: spool.status(JOB).state is JobState.FAILED)
        assert not heart.look()
    assert spool.status(JOB).message == "too late"


def test_the_last_word_is_the_last(spool: Spool) -> None:
    with Heartbeat(spool, JOB, 1) as heart:
        heart.end(JobState.DONE)
        heart.done = 0.1
        spool.ask_cancel(JOB)
        heart.end(JobState.FAILED, "no")
        assert not heart.look()
    assert heart.is_over
    assert spool.status(JOB).state is JobState.DONE


def test_who_lost_the_job_says_nothing_more(spool: Spool) -> None:
    with Heartbeat(spool, JOB, 1) as heart:
        assert Spool(spool.folder).begin_attempt(JOB, 2)
        heart.end(JobState.DONE)
        assert not heart.may_go_on()
        assert not heart.is_over
    assert spool.status(JOB) == JobStatus(JobState.RUNNING, 2)
