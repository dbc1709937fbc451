"""Suite `surgery` measures what it says, on a small ball."""

from contextlib import closing

import pytest

from benchmarks.scenes import SubjectSource
from benchmarks.suites.surgery import DENT, REBUILD, UPDATE, SurgeryPlan


@pytest.mark.slow
def test_local_updates_draw_what_a_rebuild_draws(
    ball: SubjectSource, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("benchmarks.suites.surgery.subjects", lambda quick: (ball,))
    with closing(SurgeryPlan(quick=True)) as plan:
        plan._budget_s = 0.0
        found = {task.mode: task.measure() for task in plan.tasks()}
        assert plan._patient.books.counts == 0
    error = found[UPDATE].error
    assert error is not None
    assert error.rmse == 0.0
    assert found[UPDATE].counters["edit_calls"] > 0
    assert found[REBUILD].counters["edit_ms"] > 0
    assert (
        found[DENT].counters["bend_calls"] >= found[DENT].counters["surfels_calls"] > 0
    )
