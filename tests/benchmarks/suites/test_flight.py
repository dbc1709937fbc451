"""Suite `flight` on a coarse head."""

import time
from contextlib import closing

import msgspec
import pytest

from benchmarks import nasal_views
from benchmarks.nasal_views import bundled_flight
from benchmarks.suites.flight import STAGES, FlightPlan, PacedPoses


def test_poses_come_in_order_when_their_time_has_come() -> None:
    _, path = bundled_flight()
    poses = PacedPoses(path)
    first = poses.read(1.0)
    begun = time.monotonic()
    with pytest.raises(TimeoutError):
        poses.read(0.0)
    second = poses.read(1.0)
    assert second.time_s > first.time_s
    assert second.host_time_s <= time.monotonic()
    assert first.host_time_s <= begun
    assert first.tip_mm == pytest.approx(path.sample(0.0).tip_mm)


@pytest.mark.slow
def test_every_figure_is_measured(monkeypatch: pytest.MonkeyPatch) -> None:
    scenario, path = bundled_flight()
    coarse = msgspec.structs.replace(
        scenario, head=msgspec.structs.replace(scenario.head, spacing_mm=1.0)
    )
    for module in ("suites.flight", "nasal_views"):
        monkeypatch.setattr(
            f"benchmarks.{module}.bundled_flight", lambda: (coarse, path)
        )
    monkeypatch.setattr(
        "benchmarks.nasal_views.nasal_scene", nasal_views.nasal_scene.__wrapped__
    )
    with closing(FlightPlan(quick=True)) as plan:
        plan._size, plan._flown_s, plan._places, plan._compared = 64, 0.5, 2, 1
        made = {(task.case, task.mode): task.measure() for task in plan.tasks()}
    for one in ("1 thread", "2 threads"):
        found = made["first_flight/path/frame", one].counters
        whole = sum(found[f"{stage}_ms_p50"] for stage in STAGES)
        assert 0 < found["frame_ms_p50"] <= found["frame_ms_p99"]
        assert whole > 0.5 * found["frame_ms_p50"]
    loop = made["first_flight/loop/frame", "2 threads"].counters
    assert loop["frames"] >= 1
    assert loop["frame_ms_p99"] >= loop["frame_ms_p50"] > 0
    likeness = made["first_flight/likeness", "FSR live"]
    assert likeness.error is not None
    assert 0.5 < likeness.counters["ssim_min"] <= likeness.counters["ssim_mean"] <= 1
