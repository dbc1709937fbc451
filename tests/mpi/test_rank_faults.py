"""A rank is killed at every step of a job: all its ranks end, the next worker does it.

A step that the rank does not take as often as said lets the job succeed, and is told.
"""

from pathlib import Path

import pytest

from renderers.art.job_steps import Step
from renderers.snapshots.spool import Spool
from tests.mpi.launching import NEEDS_RANKS, ranks_command, running
from tests.stress.doomed import act
from tests.stress.jobs import (
    Job,
    check_done_right,
    check_nothing_is_half,
    heal,
    is_accepted,
)

pytestmark = NEEDS_RANKS

RANKS = 3
LIMIT_S = 120.0

OF_RANK_0 = [
    *(("REQUEST_LINKED", 1), ("ATTEMPT_MADE", 1), ("ATTEMPT_TOLD", 1)),
    *(("ENTRY_REMOVED", 1), ("FILE_WRITTEN", 1), ("FILE_WRITTEN", 2)),
    *(("SCENE_LOADED", 1), ("SCENE_LOADED", 2), ("SCENE_LOADED", 3)),
    *(("FRAME_BEGUN", 1), ("FRAME_BEGUN", 2), ("RAYS_MOVED", 1), ("RAYS_MOVED", 4)),
    *(("RANK_DONE", 1), ("RANK_DONE", 2), ("FRAME_COMPLETE", 1)),
    *(("FRAME_COMPLETE", 2), ("TILE_SHOWN", 1)),
    ("PICTURE_SHADED", 1),
    *(("PICTURE_WRITTEN", 1), ("RESULT_WRITTEN", 1), ("JOB_ENDED", 1)),
]
OF_RANK_0_LATE = [("WORK_SAVED", 1), ("WORK_SAVED", 2)]
OF_THE_OTHERS = [
    *(("SCENE_LOADED", 1), ("SCENE_LOADED", 2), ("FRAME_BEGUN", 1)),
    *(("FRAME_BEGUN", 2), ("RAYS_MOVED", 1), ("RAYS_MOVED", 4), ("RANK_DONE", 1)),
    *(("RANK_DONE", 2), ("FRAME_LEFT", 1), ("FRAME_LEFT", 2)),
]


OF_NOBODY_HERE = {"DATA_STORED", "REQUEST_PUBLISHED", "CANCEL_ASKED", "JOB_HIDDEN"}


def test_no_step_is_left_out() -> None:
    steps = {step.name for step in Step} - OF_NOBODY_HERE
    assert {step for step, _ in OF_RANK_0 + OF_RANK_0_LATE + OF_THE_OTHERS} == steps


@pytest.fixture(scope="module")
def job(tmp_path_factory: pytest.TempPathFactory) -> Job:
    """Get the job that is done again and again."""
    return Job(tmp_path_factory.mktemp("job"))


@pytest.fixture(scope="module")
def large_job(tmp_path_factory: pytest.TempPathFactory) -> Job:
    """Get a job of which some is finished, and saved, long before the rest."""
    return Job(tmp_path_factory.mktemp("large"), size=(900, 800))


def kill_a_rank(
    job: Job, folder: Path, victim: int, step: str, nth: int, *, shares: bool = False
) -> None:
    """Kill one of three ranks; another worker must finish, with the right bits.

    shares: they have one memory; else cells migrate.
    """
    act(job.order(folder, "client"))
    words = ["-m", "tests.stress.doomed", str(victim), step, str(nth)]
    words += ["--spool", str(folder), "--once"]
    words += [] if shares else ["--cache-cells", "20"]
    words += ["--save-every", "0"]
    with running(ranks_command(RANKS, *words)) as child:
        said, _ = child.communicate(timeout=LIMIT_S)
    assert child.returncode != 0, f"{step} was not taken {nth} times by rank {victim}"
    assert "Traceback" not in said
    check_nothing_is_half(folder, job.request)
    assert is_accepted(folder, job)
    died = Spool(folder).status(job.request.id)
    heal(folder)
    check_done_right(folder, job)
    if died.state.is_final:
        assert Spool(folder).status(job.request.id) == died


@pytest.mark.parametrize(
    ("victim", "step", "nth"),
    [
        (0, "RAYS_MOVED", 4),
        pytest.param(2, "RAYS_MOVED", 4, marks=pytest.mark.slow),
    ],
)
def test_the_death_of_a_rank_among_rays_loses_nothing(
    job: Job, tmp_path: Path, victim: int, step: str, nth: int
) -> None:
    kill_a_rank(job, tmp_path / "spool", victim, step, nth)


@pytest.mark.parametrize(
    ("victim", "step", "nth"),
    [
        (1, "RAYS_MOVED", 2),
        pytest.param(0, "RAYS_MOVED", 2, marks=pytest.mark.slow),
        pytest.param(0, "SCENE_LOADED", 1, marks=pytest.mark.slow),
        pytest.param(2, "SCENE_LOADED", 1, marks=pytest.mark.slow),
    ],
)
def test_the_death_of_a_rank_that_shares_memory_loses_nothing(
    job: Job, tmp_path: Path, victim: int, step: str, nth: int
) -> None:
    kill_a_rank(job, tmp_path / "spool", victim, step, nth, shares=True)


@pytest.mark.slow
@pytest.mark.parametrize(("step", "nth"), OF_RANK_0)
def test_rank_0_may_die_anywhere(job: Job, tmp_path: Path, step: str, nth: int) -> None:
    kill_a_rank(job, tmp_path / "spool", 0, step, nth)


@pytest.mark.slow
@pytest.mark.parametrize(("step", "nth"), OF_RANK_0_LATE)
def test_rank_0_may_die_when_some_is_saved(
    large_job: Job, tmp_path: Path, step: str, nth: int
) -> None:
    kill_a_rank(large_job, tmp_path / "spool", 0, step, nth)


@pytest.mark.slow
@pytest.mark.parametrize(("step", "nth"), OF_THE_OTHERS)
def test_another_rank_may_die_anywhere(
    job: Job, tmp_path: Path, step: str, nth: int
) -> None:
    kill_a_rank(job, tmp_path / "spool", 1, step, nth)
