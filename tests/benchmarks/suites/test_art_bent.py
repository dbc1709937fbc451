"""Suite `art-bent` from end to end on a small ball."""

from contextlib import closing

import pytest

from benchmarks.scenes import SubjectSource
from benchmarks.suites.art_bent import BentPlan


@pytest.mark.slow
def test_bent_rays_are_dearer_than_straight_ones(
    ball: SubjectSource, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("benchmarks.suites.art_bent.subjects", lambda quick: (ball,))
    with closing(BentPlan(quick=True)) as plan:
        plan._size, plan._budget_s = 48, 0.0
        found = {(task.case, task.mode): task.measure() for task in plan.tasks()}
    case = "ball/inside/deflected"
    bent, straight = found[case, "bent rays"], found[case, "straight rays"]
    assert bent.counters is not None
    assert straight.counters is not None
    assert bent.counters["deflected"] > 0
    assert "deflected" not in straight.counters or straight.counters["deflected"] == 0
    assert bent.counters["samples"] > straight.counters["samples"]
