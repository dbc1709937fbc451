"""Suite `window` on a virtual screen."""

import pytest

from benchmarks.suites.window import DURATION_VARIABLE, WindowPlan, asked_duration_s
from system import UserError


@pytest.mark.parametrize("said", ["", "soon", "nan", "0", "-3", "1e9"])
def test_a_duration_that_is_none_is_refused(
    said: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(DURATION_VARIABLE, said)
    with pytest.raises(UserError, match=DURATION_VARIABLE):
        asked_duration_s()


def test_ten_minutes_are_flown_where_they_are_asked_for(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv(DURATION_VARIABLE, "600")
    every = WindowPlan(quick=False).tasks()
    tasks = [task for task in every if task.case.startswith("first_flight")]
    assert {task.settings["most"] for task in tasks} == {512, 1024}
    assert {task.settings["flown_s"] for task in tasks} == {600.0}
    assert all(task.cost_s > 600.0 for task in tasks)
    # an operation lasts as long as it does
    assert 10.0 < max(task.cost_s for task in every if task not in tasks) < 60.0


@pytest.mark.display
@pytest.mark.slow
def test_the_window_is_flown_and_measured() -> None:
    for task in WindowPlan(quick=True).tasks():
        require_figures(task.measure().counters)


def require_figures(found: dict[str, float]) -> None:
    assert found["frames"] >= 3
    assert 0 < found["pose_age_ms_p50"] <= found["pose_age_ms_p99"]
    assert 0 < found["picture_px_mean"] <= 512
    assert found["start_to_picture_s"] > 0
    assert 0 < found["window_cpu_ms_a_frame"] < found["cpu_ms_a_frame"]
    assert found["rss_end_mib"] > 100
