"""Suite `art-kernels` from end to end, small."""

import pytest

from benchmarks.plan import Measured
from benchmarks.suites.art_kernels import LIGHTS, TARGETS, KernelPlan


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_code_for_a_lesser_processor_draws_the_same_picture() -> None:
    plan = KernelPlan(quick=True)
    plan._sizes.voxels = plan._sizes.pixels = 32
    plan._sizes.budget_s = 0.0
    plan._sizes.spacing_mm = 3.0
    found: dict[tuple[str, str], Measured] = {
        (task.case, task.mode): task.measure()
        for task in plan.tasks()
        if LIGHTS[1] not in task.case
    }
    case = f"shells/{LIGHTS[0]}/instructions"
    first, second = (found[case, target].counters for target in TARGETS)
    assert first["samples"] == second["samples"]
    for counters in (first, second):
        assert counters["share_of_limit"] > 0
    live = found["head of 256/inside/surface", "ART preview"]
    # silhouettes are far off at 3 mm, what is met is the same
    assert live.counters["missing"] + live.counters["extra"] < 0.02
    assert live.counters["frames_per_second"] > 0
