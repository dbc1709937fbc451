"""Suite `fsr` from end to end on a small ball."""

from contextlib import closing

import pytest

from benchmarks.plan import Measured, UnavailableError
from benchmarks.scenes import SubjectSource
from benchmarks.suites.fsr import FsrPlan
from benchmarks.suites.splat_plan import PEER


def plan_for(ball: SubjectSource, monkeypatch: pytest.MonkeyPatch) -> FsrPlan:
    monkeypatch.setattr("benchmarks.suites.fsr.subjects", lambda quick: (ball,))
    monkeypatch.setattr("benchmarks.suites.fsr.SCOPE_SIZE", 64)
    plan = FsrPlan(quick=True)
    plan._size = 64
    plan.budget_s = 0.0
    return plan


@pytest.mark.slow
def test_every_measurement_is_near_its_reference(
    ball: SubjectSource, monkeypatch: pytest.MonkeyPatch
) -> None:
    found: dict[tuple[str, str], Measured] = {}
    with closing(plan_for(ball, monkeypatch)) as plan:
        for task in plan.tasks():
            try:
                found[task.case, task.mode] = task.measure()
            except UnavailableError:
                assert task.mode == PEER
    for (_, mode), made in found.items():
        assert made.error is not None
        assert made.timing.cpu_s > 0
        assert (
            made.error.rmse
            < {"linear": 0.15, "mm": 0.5, "sRGB": 0.1}[str(made.error_unit)]
        ), mode
    one = found["ball/inside/picture", "FSR live, 1 thread"]
    two = found["ball/inside/picture", "FSR live, 2 threads"]
    assert one.counters["ssim"] == two.counters["ssim"] > 0.9
    assert one.error == two.error
    surface = found["ball/inside/surface", "FSR surfels"].counters
    assert surface["missing"] == 0
    assert surface["normal_deg_mean"] < 3
