"""Suite `light` on a coarse head."""

from contextlib import closing

import msgspec
import pytest

from benchmarks import nasal_views
from benchmarks.nasal_views import bundled_flight
from benchmarks.suite_light import NOTHING, PATHS, LightPlan


@pytest.mark.slow
def test_more_virtual_lights_come_nearer_to_the_truth(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    scenario, path = bundled_flight()
    head = msgspec.structs.replace(scenario.head, spacing_mm=1.0)
    coarse = msgspec.structs.replace(scenario, head=head)
    monkeypatch.setattr("benchmarks.nasal_views.bundled_flight", lambda: (coarse, path))
    monkeypatch.setattr(
        "benchmarks.suite_light.nasal_scene", nasal_views.nasal_scene.__wrapped__
    )
    with closing(LightPlan(quick=True)) as plan:
        made = {task.mode: task.measure() for task in plan.tasks()}
    assert 0 < made[PATHS].counters["noise, worst view"] < 0.3
    rmse = {mode: found.error.rmse for mode, found in made.items() if found.error}
    assert rmse["256 virtual lights"] < rmse[NOTHING] / 2
    assert rmse["512 virtual lights"] < rmse[NOTHING] / 2
