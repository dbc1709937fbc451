"""Suite `visibility` measures what it says, on a small ball."""

from contextlib import closing

import pytest

from benchmarks.scenes import SubjectSource
from benchmarks.suites.visibility import CONES, NOTHING, SETS, VisibilityPlan
from renderers.scene import Camera


def test_sets_list_no_more_than_cones(
    ball: SubjectSource, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("benchmarks.suites.visibility.subjects", lambda quick: (ball,))
    cameras = [
        Camera.looking_at((x, 0.0, 0.0), (x, 4.0, 1.0), size=(48, 48)) for x in (0, 1)
    ]
    with closing(VisibilityPlan(quick=True)) as plan:
        plan.__dict__["_cameras"] = cameras
        plan._views = len(cameras)
        plan._budget_s = 0.0
        found = {task.mode: task.measure() for task in plan.tasks()}
    for mode in (NOTHING, CONES, SETS):
        error = found[mode].error
        assert error is not None
        assert error.rmse == 0.0
    listed = {mode: found[mode].counters["surfels_listed"] for mode in (NOTHING, SETS)}
    assert 0 < listed[SETS] <= listed[NOTHING]
    assert found[SETS].counters["views_looked_up"] == 2
    assert found[CONES].counters["views_looked_up"] == 0
