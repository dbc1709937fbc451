"""Suite `fsr-growth` names what each of its rows grows with."""

from collections import Counter
from contextlib import closing

import pytest

from benchmarks.scenes import Subject
from benchmarks.suites.fsr_growth import FsrGrowthPlan
from tests.benchmarks.conftest import hollow_ball


@pytest.mark.parametrize("quick", [True, False])
def test_every_sweep_has_three_points_at_least(quick: bool) -> None:
    with closing(FsrGrowthPlan(quick)) as plan:
        tasks = plan.tasks()
    told = [(t.case, t.settings["grows_with"], t.settings["series"]) for t in tasks]
    assert min(Counter(told).values()) >= 3
    assert {name for _, name, _ in told} == {"pixels", "splats"}


@pytest.mark.slow
def test_what_is_drawn_grows(monkeypatch: pytest.MonkeyPatch) -> None:
    def ball(spacing_mm: float) -> Subject:
        return hollow_ball()

    monkeypatch.setattr("benchmarks.suites.fsr_growth.phantom_subject", ball)
    monkeypatch.setattr("benchmarks.suites.fsr_growth.QUICK_SPLATS", (400, 800, 1600))
    with closing(FsrGrowthPlan(quick=True)) as plan:
        plan._budget_s = 0.0
        chosen = [
            task
            for task in plan.tasks()
            if task.settings["series"] == "FSR gaussian"
            and task.settings["grows_with"] == "splats"
        ]
        fragments = [task.measure().counters["fragments"] for task in chosen]
    assert fragments == sorted(set(fragments))
