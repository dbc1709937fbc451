import sys

import pytest

from benchmarks.suites.haptics import HapticsPlan

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="its clock is Linux's")


@pytest.mark.slow
@pytest.mark.parametrize("number", [0, 1])
def test_the_loop_ticks_beside_whatever_is_drawn(number: int) -> None:
    measured = HapticsPlan(quick=True).tasks()[number].measure()
    told = measured.counters
    assert measured.timing.repeats > 100
    assert 0.0 < told["tick_us"] <= told["dearest_tick_us"]
    assert (told["frames_per_s"] > 0.0) == bool(number)
