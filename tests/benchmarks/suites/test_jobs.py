"""Jobs are drawn, seen early and cancelled, each in the middle of the real thing."""

from contextlib import closing

import pytest

from benchmarks.suites.jobs import JobsPlan


@pytest.mark.slow
def test_a_job_has_the_pixels_of_its_team_and_a_coarse_one_nearly() -> None:
    with closing(JobsPlan(quick=True)) as plan:
        tasks = {(task.case, task.mode): task for task in plan.tasks()}
        found = {
            mode: tasks["classic picture", mode].measure()
            for mode in ("job", "job shown as it grows", "first sight of it")
        }
        told = tasks["cancel, snapshot", "client is told"].measure()
    for mode in ("job", "job shown as it grows"):
        error = found[mode].error
        assert error is not None
        assert error.max == 0
    coarse = found["first sight of it"].error
    assert coarse is not None
    assert 0 < coarse.rmse < 60
    assert told.timing.min_s > 0
