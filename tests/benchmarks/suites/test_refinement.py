"""Suite `refinement` on a coarse head."""

from collections.abc import Callable
from contextlib import closing

import pytest

from benchmarks.suites.refinement import SHARES, TOLERANCES, RefinementPlan
from renderers.scene import Scene


@pytest.mark.slow
def test_the_more_samples_the_less_error_and_none_in_the_end(
    monkeypatch: pytest.MonkeyPatch, coarse_nasal_scene: Callable[[str], Scene]
) -> None:
    monkeypatch.setattr("benchmarks.suites.refinement.nasal_scene", coarse_nasal_scene)
    with closing(RefinementPlan(quick=True)) as plan:
        made = {task.mode: task.measure() for task in plan.tasks()}
    for tolerance in TOLERANCES:
        told = made[f"to {tolerance:g} codes"].counters["error told, codes rms"]
        assert 0 < told <= tolerance
    found = [
        measured for mode, measured in made.items() if mode.startswith("four samples f")
    ]
    assert len(found) == len(SHARES)
    error = [measured.counters["error found, codes rms"] for measured in found]
    share = [measured.counters["share of samples"] for measured in found]
    assert share[0] == 0.25
    assert share == sorted(share)
    assert error == sorted(error, reverse=True)
    assert error[-1] == 0
