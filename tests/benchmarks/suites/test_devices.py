import sys

import pytest

from benchmarks.suites.devices import (
    AT_ONCE,
    CONFIRMED,
    FRAME_S,
    DevicesPlan,
    measure_reader,
)
from devices.microscribe.driver.sampler import MotionReports
from tests.slow_cases import slow

pytestmark = pytest.mark.skipif(
    sys.platform == "win32", reason="pseudo-terminals need POSIX"
)


def test_the_soak_belongs_to_the_full_run_only() -> None:
    full, quick = DevicesPlan(quick=False).tasks(), DevicesPlan(quick=True).tasks()
    assert {task.case for task in full} - {task.case for task in quick} == {"soak"}
    assert len({task.key for task in full}) == len(full)


@pytest.mark.parametrize(
    ("reports", "frame_s"),
    [*slow((AT_ONCE, None), (CONFIRMED, None)), (CONFIRMED, FRAME_S)],
)
def test_every_packet_becomes_a_pose(
    reports: MotionReports, frame_s: float | None
) -> None:
    measured = measure_reader(reports, 0.5, frame_s)
    told = measured.counters
    assert told["lost"] == told["noise"] == told["framing"] == 0.0
    assert told["poses"] == measured.timing.repeats > 50
    assert 0.0 < measured.timing.cpu_s < 0.01
    assert measured.timing.min_s > 0.0


@pytest.mark.slow
def test_polls_are_measured_too() -> None:
    measured = measure_reader(None, 0.3)
    assert measured.counters["poses"] > 5
    assert measured.timing.cpu_s > 0.0
