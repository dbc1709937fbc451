"""Suite `light` on a coarse head."""

from collections.abc import Callable
from contextlib import closing

import pytest

from benchmarks.suites.light import NOTHING, PATHS, LightPlan
from renderers.scene import Scene


@pytest.mark.slow
def test_more_virtual_lights_come_nearer_to_the_truth(
    monkeypatch: pytest.MonkeyPatch, coarse_nasal_scene: Callable[[str], Scene]
) -> None:
    monkeypatch.setattr("benchmarks.suites.light.nasal_scene", coarse_nasal_scene)
    with closing(LightPlan(quick=True)) as plan:
        made = {task.mode: task.measure() for task in plan.tasks()}
    assert 0 < made[PATHS].counters["noise, worst view"] < 0.3
    rmse = {mode: found.error.rmse for mode, found in made.items() if found.error}
    assert rmse["256 virtual lights"] < rmse[NOTHING] / 2
    assert rmse["512 virtual lights"] < rmse[NOTHING] / 2
