"""The trainee's window as a whole: frame rate, latency, memory, its start.

``PARAVOL_WINDOW_S=600 paravol bench --suite window`` flies for ten minutes at each
size; without it for ten seconds. Nothing else should run meanwhile: both cores are
needed.
"""

import os
from functools import cached_property, partial

import numpy as np

from benchmarks.nasal_views import bundled_flight
from benchmarks.plan import Measured, Plan, Task
from benchmarks.timing import Timing
from benchmarks.window_program import begin_of, fly_window, to_and_fro
from devices import ProbePath, load_probe_path
from scenarios import load_scenario
from system import UserError

SCENARIO, OPERATION = "first_flight", "first_operation"

OPERATED_S = 38.0
"""So much of an operation is flown: looks, needle and the first bites."""

STEERED, STEERED_S, STEERED_QUICK_S = "uncinectomy", 36.0, 15.0
"""What is operated by the mouse, and for how long: twelve seconds pass before the tool
works."""

SCREENS = {512: (1600, 900), 1024: (2560, 1440)}
"""For each largest picture a screen on which its place is at least as large."""

DURATION_VARIABLE = "PARAVOL_WINDOW_S"
FLOWN_S = 10.0


class WindowPlan(Plan, suite="window"):
    """List and make the measurements of suite `window`."""

    def __init__(self, quick: bool) -> None:
        super().__init__(quick)
        self._flown_s = 3.0 if quick else asked_duration_s()
        self._steered_s = STEERED_QUICK_S if quick else STEERED_S
        self._sizes = (512,) if quick else (512, 1024)

    def tasks(self) -> list[Task]:
        """List the tasks, the small picture first."""
        return [
            self.task(
                f"{scenario}/window",
                f"{size} px",
                partial(self._flown, scenario, path, size),
                {"most": size, "flown_s": round(float(path.t_s[-1]), 1)},
                clock="wall",
                cost_s=float(path.t_s[-1]) + 20.0,
            )
            for scenario, path in self._paths.items()
            for size in self._sizes
        ] + [
            self.task(
                f"{STEERED}/mouse",
                f"{size} px",
                partial(self._flown, STEERED, self._steered_s, size),
                {"most": size, "flown_s": self._steered_s},
                clock="wall",
                cost_s=self._steered_s + 20.0,
            )
            for size in self._sizes
        ]

    @cached_property
    def _paths(self) -> dict[str, ProbePath]:
        """Return the bundled paths: one to and fro, one of an operation as it is."""
        scenario, folder = load_scenario(OPERATION)
        return {
            SCENARIO: to_and_fro(bundled_flight()[1], self._flown_s),
            OPERATION: begin_of(load_probe_path(folder / scenario.path), OPERATED_S),
        }

    @staticmethod
    def _flown(scenario: str, path: ProbePath | float, size: int) -> Measured:
        """Fly along a path in the window, or by mouse so long; all panels on."""
        flown = fly_window(scenario, path, SCREENS[size], size)
        counters = flown.counters()
        middle = counters["frame_ms_p50"] / 1e3
        spent = counters["cpu_ms_a_frame"] / 1e3
        timing = Timing(middle, middle, spent, max(len(flown.sizes), 1))
        return Measured(timing, counters=counters)


def asked_duration_s() -> float:
    """Return how long to fly at each size, seconds, as the environment says."""
    said = os.environ.get(DURATION_VARIABLE, str(FLOWN_S))
    try:
        found = float(said)
    except ValueError:
        found = np.nan
    if not 1.0 <= found <= 3600.0:
        raise UserError(
            f"{DURATION_VARIABLE} must be seconds from 1 to 3600, got {said!r}"
        )
    return found
