"""Suite `look` on a coarse head."""

from contextlib import closing

import msgspec
import pytest

from benchmarks import nasal_views
from benchmarks.nasal_views import bundled_flight
from benchmarks.suite_look import EVERYTHING, RAGGED, SHARP, LookPlan


def test_baselines_come_first_and_names_are_unique() -> None:
    with closing(LookPlan(quick=True)) as plan:
        tasks = plan.tasks()
    known: set[tuple[str, str]] = set()
    for task in tasks:
        assert task.baseline is None or (task.case, task.baseline) in known
        known.add((task.case, task.mode))
    assert len({task.key for task in tasks}) == len(tasks) == 11


@pytest.mark.slow
def test_each_ingredient_is_missed_and_rays_mend_rims(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    scenario, path = bundled_flight()
    head = msgspec.structs.replace(scenario.head, spacing_mm=1.0)
    coarse = msgspec.structs.replace(scenario, head=head)
    monkeypatch.setattr("benchmarks.nasal_views.bundled_flight", lambda: (coarse, path))
    monkeypatch.setattr(
        "benchmarks.suite_look.nasal_scene", nasal_views.nasal_scene.__wrapped__
    )
    with closing(LookPlan(quick=True)) as plan:
        plan._size, plan._budget_s = 96, 0.0
        made = {(t.case, t.mode): t.measure() for t in plan.tasks()}
    for (case, mode), found in made.items():
        if mode == EVERYTHING:
            assert found.error is not None
            assert found.error.rmse == 0
            assert found.counters["metal pixels"] > 50
        elif "shading" in case:
            assert found.error is not None
            assert found.error.rmse > 0, mode
    share = "pixels of another wall, share"
    rims = {mode: found for (case, mode), found in made.items() if "rims" in case}
    assert rims[SHARP].counters[share] < rims[RAGGED].counters[share]
