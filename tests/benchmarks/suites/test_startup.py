"""Children are timed from birth to death, with what they spent."""

import sys

import pytest

from benchmarks.plan import UnavailableError
from benchmarks.suites.startup import StartupPlan, run_child


def test_a_sleeping_child_costs_wall_time_only() -> None:
    wall_s, cpu_s = run_child(
        [sys.executable, "-S", "-c", "import time; time.sleep(0.3)"]
    )
    assert wall_s >= 0.3
    assert 0 < cpu_s < 0.3


def test_a_failing_child_is_a_reason() -> None:
    with pytest.raises(UnavailableError, match="ended with 1: ValueError: no luck"):
        run_child([sys.executable, "-c", "raise ValueError('no luck')"])


@pytest.mark.slow
def test_the_first_frame_and_both_workers_come_to_an_end() -> None:
    tasks = {(task.case, task.mode): task for task in StartupPlan(quick=True).tasks()}
    for key in (("first frame", "kernels cached"), ("worker", "1 rank")):
        assert tasks[key].measure().timing.min_s > 0
