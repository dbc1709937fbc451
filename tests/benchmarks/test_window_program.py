"""The window as it is looked at from outside."""

import os
import subprocess
import sys
import time

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks.nasal_views import bundled_flight
from benchmarks.window_program import ProcessUse, WindowFlight, _look, to_and_fro


def looks(slope: float, jump: float, seconds: float = 60.0) -> list[ProcessUse]:
    """A process that takes `jump` MiB in its first four seconds, then `slope` a min."""
    times = np.arange(0.0, seconds, 0.5)
    return [
        ProcessUse(
            t, 900.0 + jump * min(t / 4.0, 1.0) + slope * t / 60.0, 0.1 * t, 0.9 * t
        )
        for t in times.tolist()
    ]


@given(st.floats(-5.0, 50.0), st.floats(0.0, 300.0))
def test_memory_that_is_taken_once_is_no_growth(slope: float, jump: float) -> None:
    flight = WindowFlight(1.0, {}, [512], looks(slope, jump))
    begin, end, found = flight.memory()
    assert found == pytest.approx(slope, abs=1e-6)
    assert end - begin == pytest.approx(slope * (59.5 - 30.0) / 60.0, abs=1e-6)


def test_shares_of_time_are_of_one_core() -> None:
    timing: dict[str, float | dict[str, float]] = {"fps": 30.0, "frame_ms": {"p50": 31}}
    found = WindowFlight(2.5, timing, [1024] * 590, looks(0.0, 0.0)).counters()
    assert found["window_cpu_share"] == pytest.approx(0.1)
    assert found["flight_cpu_share"] == pytest.approx(0.8)
    assert found["cpu_ms_a_frame"] == pytest.approx(1e3 * 0.9 * 59.5 / 590)
    assert found["frame_ms_p50"] == 31
    assert found["start_to_picture_s"] == 2.5
    assert found["start_cpu_s"] == 0.0


@given(st.floats(0.1, 200.0))
def test_a_path_to_and_fro_stays_on_its_places(duration_s: float) -> None:
    path = bundled_flight()[1]
    flown = to_and_fro(path, duration_s)
    assert (np.diff(flown.t_s) > 0).all()
    assert duration_s - 0.02 < flown.t_s[-1] <= duration_s
    assert not flown.buttons.any()
    # a time runs forwards in the first turn and backwards in the next
    at = flown.t_s % (2 * path.t_s[-1])
    at = np.where(at > path.t_s[-1], 2 * path.t_s[-1] - at, at)
    for axis in range(3):
        there = np.interp(at, path.t_s, path.tip_mm[:, axis])
        np.testing.assert_allclose(flown.tip_mm[:, axis], there, atol=1e-6)


@pytest.mark.skipif(not os.path.exists("/proc/self/task"), reason="needs /proc")
def test_a_look_sees_memory_and_cpu_time_of_a_process() -> None:
    script = "kept = bytes(range(256)) * 400_000\nprint(flush=True)\nwhile True: pass"
    command = [sys.executable, "-S", "-c", script]
    with subprocess.Popen(command, stdout=subprocess.PIPE) as child:
        try:
            assert child.stdout is not None
            child.stdout.readline()
            begun, before = time.monotonic(), _look(child.pid, 0.0)
            while _look(child.pid, 0.0).cpu_s < before.cpu_s + 0.1:
                assert time.monotonic() < begun + 60.0
                time.sleep(0.01)
        finally:
            child.kill()
    assert 100 < before.rss_mib < 200
    assert before.window_cpu_s == pytest.approx(before.cpu_s, abs=0.1)
