"""The window's memory does not grow in a flight of two minutes.

What it takes once, in its first minute, is left out.
"""

from pathlib import Path

import pytest

from benchmarks.nasal_views import bundled_flight
from benchmarks.window_program import fly_window, to_and_fro

pytestmark = [pytest.mark.display, pytest.mark.slow]

FLOWN_S = 120.0
SCREEN = 1280, 800
SIZE = 256
MOST_MIB_A_MINUTE = 4.0
"""Measured: none in the second minute. What may grow are the times of frames, 64 bytes
each, and the score's figures of 100 poses a second, together less than 1 MiB. A picture
of this size kept every three seconds would be as much as this."""


@pytest.mark.timeout(500)
def test_memory_does_not_grow_in_flight(coarse_scenario: Path) -> None:
    path = to_and_fro(bundled_flight()[1], FLOWN_S)
    flown = fly_window(str(coarse_scenario), path, SCREEN, SIZE)
    begin, end, slope = flown.memory()
    told = f"{begin:.0f} to {end:.0f} MiB, {slope:.2f} MiB a minute"
    print(told)
    # all of it was flown
    assert flown.looks[-1].at_s - flown.first_s > 0.9 * FLOWN_S
    assert slope < MOST_MIB_A_MINUTE, told
