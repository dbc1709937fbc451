"""A job is left to its next worker in the middle of the real thing."""

from contextlib import closing

import pytest

from benchmarks.suites.takeover import ANEW, GONE_ON, RAYS, UNDISTURBED, TakeoverPlan


@pytest.mark.slow
def test_a_job_gone_on_with_has_the_same_picture() -> None:
    with closing(TakeoverPlan(quick=True)) as plan:
        tasks = {(task.case, task.mode): task for task in plan.tasks()}
        found = {
            mode: tasks[RAYS, mode].measure() for mode in (UNDISTURBED, ANEW, GONE_ON)
        }
    for measured in found.values():
        assert measured.error is not None
        assert measured.error.max == 0
    assert found[ANEW].counters["rays_kept"] == 0
    assert found[GONE_ON].counters["rays_kept"] > 0
