"""Suite `art-growth`: its scene, its sweeps."""

import numpy as np
import pytest

from benchmarks.suites.art_growth import GrowthPlan, shell_scene, shells


def test_shells_are_the_same_at_any_size() -> None:
    """Air between tissue, as much of each; the same places have the same values."""
    coarse, fine = shells(33), shells(65)
    assert np.array_equal(coarse.values, fine.values[::2, ::2, ::2])
    share = float(np.mean(fine.values > 300))
    assert 0.3 < share < 0.5
    assert shell_scene(coarse, lit=False).transfer_function.is_clear(-1000, 300)


def test_a_sweep_names_what_it_grows_with() -> None:
    plan = GrowthPlan(quick=True)
    plan._budget_s = 0.0
    tasks = [t for t in plan.tasks() if t.case == "shells/no lights/pixels"]
    first, second = (task.measure() for task in tasks)
    assert [task.settings["amount"] for task in tasks] == [128**2, 256**2]
    assert {task.settings["grows_with"] for task in tasks} == {"pixels"}
    assert second.counters["samples"] > 3.5 * first.counters["samples"]
    # Int16 values and a byte of distance; no gradients without lights.
    assert second.counters["bytes_per_voxel"] == pytest.approx(3, abs=0.05)
