"""Suite `look` on a coarse head."""

from collections.abc import Callable
from contextlib import closing

import pytest

from benchmarks.suites.look import EVERYTHING, LookPlan
from renderers.scene import Scene


@pytest.mark.slow
def test_each_ingredient_is_missed(
    monkeypatch: pytest.MonkeyPatch, coarse_nasal_scene: Callable[[str], Scene]
) -> None:
    monkeypatch.setattr("benchmarks.suites.look.nasal_scene", coarse_nasal_scene)
    with closing(LookPlan(quick=True)) as plan:
        plan._size, plan._budget_s = 96, 0.0
        made = {(t.case, t.mode): t.measure() for t in plan.tasks()}
    for (_, mode), found in made.items():
        if mode == EVERYTHING:
            assert found.error is not None
            assert found.error.rmse == 0
            assert found.counters["metal pixels"] > 50
        else:
            assert found.error is not None
            assert found.error.rmse > 0, mode
