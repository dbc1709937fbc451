"""Client and worker are killed at every step of a job; no accepted request is lost.

Each step is a place in the code that says so by `reached`; a rehearsal lists how often
each is taken, and each time is then a case. MPI has its own cases in tests/mpi.
"""

import signal
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pytest

from renderers.art.job_steps import Step
from renderers.snapshots.spool import JobState, Spool
from tests.stress.jobs import (
    Children,
    Job,
    check_done_right,
    check_nothing_is_half,
    doomed_children,
    heal,
    is_accepted,
)

OF_RANKS = {"FRAME_COMPLETE", "FRAME_LEFT"}
"""Taken under MPI only."""

OF_OTHERS = {"DATA_STORED", "REQUEST_PUBLISHED", "CANCEL_ASKED", "JOB_HIDDEN"}
"""Taken by no worker that draws."""

BY_TIME = {"FILE_WRITTEN", "RAYS_MOVED", "TILE_SHOWN", "WORK_SAVED"}
"""How often these are taken depends on how long the picture takes."""

FAST = [
    ("REQUEST_LINKED", 1),
    ("ATTEMPT_MADE", 1),
    ("FILE_WRITTEN", 1),
    ("ENTRY_REMOVED", 1),
    ("RAYS_MOVED", 2),
    ("WORK_SAVED", 1),
    ("PICTURE_SHADED", 1),
    ("RESULT_WRITTEN", 1),
]
"""One of each kind; all the others are slow."""


@pytest.fixture(scope="module")
def job(tmp_path_factory: pytest.TempPathFactory) -> Job:
    """Get the job that is done again and again."""
    return Job(tmp_path_factory.mktemp("job"))


@pytest.fixture(scope="module")
def children(job: Job, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Children]:
    """Get the process that makes children."""
    with doomed_children(job, tmp_path_factory.mktemp("children")) as process:
        yield process


def rehearse(children: Children, job: Job, folder: Path) -> dict[str, Counter[str]]:
    """Count the steps that each role takes when nothing happens."""
    steps = {}
    for role in ("client", "worker", "canceller", "pruner"):
        outcome = children.run(job.order(folder, role))
        assert outcome.signal is None
        steps[role] = Counter(outcome.steps)
    return steps


def kill_a_worker(
    children: Children, job: Job, folder: Path, step: str, nth: int
) -> None:
    """Kill the first worker; the second must finish, with the right bits."""
    children.run(job.order(folder, "client"))
    died = children.run(job.order(folder, "worker", step, nth))
    if died.signal is None:
        # It was quicker this time, and did not take the step so often.
        assert step in BY_TIME
        assert nth > died.steps.count(step)
    else:
        assert died.signal == signal.SIGKILL
    check_nothing_is_half(folder, job.request)
    assert is_accepted(folder, job)
    heal(folder)
    check_done_right(folder, job)


def kill_a_client(
    children: Children, job: Job, folder: Path, step: str, nth: int
) -> None:
    """Kill the client; what it had published is drawn, else it may ask again."""
    died = children.run(job.order(folder, "client", step, nth))
    assert died.signal == signal.SIGKILL
    check_nothing_is_half(folder, job.request)
    accepted = is_accepted(folder, job)
    heal(folder)
    if accepted:
        check_done_right(folder, job, most_attempts=1)
    children.run(job.order(folder, "client"))
    heal(folder)
    check_done_right(folder, job, most_attempts=1)


def test_every_step_is_taken_by_somebody(
    children: Children, job: Job, tmp_path: Path
) -> None:
    steps = rehearse(children, job, tmp_path / "spool")
    taken = set().union(*steps.values())
    assert taken | OF_RANKS == {step.name for step in Step}
    assert set(dict(FAST)) <= set(steps["worker"])
    assert not list((tmp_path / "spool" / "jobs").iterdir())
    assert not list((tmp_path / "spool" / "data").iterdir())


@pytest.mark.parametrize(("step", "nth"), FAST)
def test_a_killed_worker_loses_nothing(
    children: Children, job: Job, tmp_path: Path, step: str, nth: int
) -> None:
    kill_a_worker(children, job, tmp_path / "spool", step, nth)


@pytest.mark.parametrize(
    ("step", "nth"), [("DATA_STORED", 1), ("FILE_WRITTEN", 2), ("REQUEST_PUBLISHED", 1)]
)
def test_a_killed_client_loses_nothing_that_was_accepted(
    children: Children, job: Job, tmp_path: Path, step: str, nth: int
) -> None:
    kill_a_client(children, job, tmp_path / "spool", step, nth)


@pytest.mark.slow
def test_worker_and_client_may_die_anywhere(
    children: Children, job: Job, tmp_path: Path
) -> None:
    steps = rehearse(children, job, tmp_path / "rehearsed")
    for role, kill in (("client", kill_a_client), ("worker", kill_a_worker)):
        for step, times in steps[role].items():
            for nth in range(1, times + 1):
                kill(children, job, tmp_path / f"{role}-{step}-{nth}", step, nth)


@pytest.mark.slow
def test_two_workers_may_die_of_one_job(
    children: Children, job: Job, tmp_path: Path
) -> None:
    steps = rehearse(children, job, tmp_path / "rehearsed")["worker"]
    for first in steps:
        for second in steps:
            folder = tmp_path / f"{first}-{second}"
            children.run(job.order(folder, "client"))
            children.run(job.order(folder, "worker", first))
            # One that takes over makes no claim, so that not every step is its own.
            children.run(job.order(folder, "worker", second))
            check_nothing_is_half(folder, job.request)
            heal(folder)
            check_done_right(folder, job, most_attempts=3)


@pytest.mark.parametrize(
    "step",
    [
        "FILE_WRITTEN",
        "RAYS_MOVED",
        *(
            pytest.param(step.name, marks=pytest.mark.slow)
            for step in Step
            if step.name not in {*OF_RANKS, *OF_OTHERS, "FILE_WRITTEN", "RAYS_MOVED"}
        ),
    ],
)
def test_a_worker_thought_dead_spoils_nothing_when_it_wakes(
    children: Children, job: Job, tmp_path: Path, step: str
) -> None:
    folder = tmp_path / "spool"
    children.run(job.order(folder, "client"))
    order = job.order(folder, "worker", step)
    order.signal = signal.SIGSTOP
    stopped = children.run(order)
    assert stopped.signal == signal.SIGSTOP
    check_nothing_is_half(folder, job.request)
    heal(folder)
    check_done_right(folder, job)
    before = Spool(folder).status(job.request.id)
    assert children.awaken(stopped.pid).signal is None
    check_done_right(folder, job)
    assert Spool(folder).status(job.request.id) == before


def test_a_cancelled_job_stays_cancelled_whoever_dies(
    children: Children, job: Job, tmp_path: Path
) -> None:
    folder = tmp_path / "spool"
    children.run(job.order(folder, "client"))
    died = children.run(job.order(folder, "canceller", "CANCEL_ASKED"))
    assert died.signal == signal.SIGKILL
    died = children.run(job.order(folder, "worker", "ATTEMPT_TOLD"))
    assert died.signal == signal.SIGKILL
    heal(folder)
    assert Spool(folder).status(job.request.id).state is JobState.CANCELLED
    check_nothing_is_half(folder, job.request)


def test_a_killed_pruner_leaves_no_half_job(
    children: Children, job: Job, tmp_path: Path
) -> None:
    folder = tmp_path / "spool"
    children.run(job.order(folder, "client"))
    heal(folder)
    died = children.run(job.order(folder, "pruner", "JOB_HIDDEN"))
    assert died.signal == signal.SIGKILL
    assert Spool(folder).status(job.request.id).state is JobState.QUEUED
    assert not is_accepted(folder, job)
    # PatternCost for again, it is drawn again.
    children.run(job.order(folder, "client"))
    heal(folder)
    check_done_right(folder, job, most_attempts=1)
    children.run(job.order(folder, "pruner"))
    assert not list((folder / "jobs").iterdir())
    assert not list((folder / "data").iterdir())
