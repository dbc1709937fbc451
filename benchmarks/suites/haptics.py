"""How late the force loop is and what it takes: alone, beside live frames and cuts."""

import sys
import time
from functools import partial

import numpy as np

from benchmarks.nasal_views import bundled_flight
from benchmarks.plan import Measured, Plan, Task, UnavailableError
from benchmarks.schema import Setting
from benchmarks.timing import Timing
from devices.haptics.mock_head import MockHead
from paravol.haptics.force_loop import (
    PERIOD_S,
    ForceLoop,
    LoopFigures,
    new_feeling,
    scope_balls,
)
from paravol.haptics.tissue_copies import TissueCopies
from paravol.patient import load_patient, no_progress
from paravol.sessions.session_setup import (
    build_view,
    first_views,
    operate_on,
    path_view,
)
from scenarios import tip_frame
from surgery import solids
from surgery.edit import CuttingLimits

ALONE, BESIDE = "alone", "beside frames and cuts"
LONG_S, SHORT_S = 20.0, 3.0
FULL_SIZE, QUICK_SIZE = 512, 128
HAND_HZ = 100.0
DEEPER_MM = 1.0
"""So much beyond the recorded path the hand goes, so that walls are met."""

CUT_EVERY, CUT_MM, AHEAD_MM = 6, 1.0, 6.0
"""Frames between two cuts, their radius, how far ahead of the tip they are tried."""


class HapticsPlan(Plan, suite="haptics"):
    """List and make the measurements of suite `haptics`."""

    def __init__(self, quick: bool) -> None:
        super().__init__(quick)
        self._seconds = SHORT_S if quick else LONG_S
        self._size = QUICK_SIZE if quick else FULL_SIZE

    def tasks(self) -> list[Task]:
        """List the tasks, the loop alone first."""
        settings: dict[str, Setting] = {"seconds": self._seconds, "size": self._size}
        cost_s = self._seconds + 60.0
        return [
            self.task(
                "force loop, 1 kHz",
                mode,
                partial(self._run, mode == BESIDE),
                settings,
                cost_s=cost_s,
            )
            for mode in (ALONE, BESIDE)
        ]

    def _run(self, draws: bool) -> Measured:
        """Run the loop on the bundled flight, led as by a hand."""
        if sys.platform != "linux":
            raise UnavailableError("the force loop sleeps by a clock of Linux")
        scenario, path = bundled_flight()
        head, operation = operate_on(load_patient(scenario, no_progress))
        patient = operation.patient
        radius_mm = scenario.scope.endoscope().diameter_mm / 2
        device, copies = MockHead(), TissueCopies(patient)
        size = (self._size, self._size)
        view = build_view(scenario, head, threads=2)
        if draws:
            view.warm_up(first_views(scenario, head, path, size), no_progress)
        balls = scope_balls(radius_mm)
        feeling = new_feeling(patient.layers, balls, device.limits, PERIOD_S)
        with ForceLoop(device, copies.tissue, feeling) as loop:
            loop.place(np.eye(4))
            began, number = time.monotonic(), 0
            while (passed := time.monotonic() - began) < self._seconds:
                at = path.sample(passed % path.duration_s)
                pose = tip_frame(at.tip_mm, at.axis)
                pose[:3, 3] -= DEEPER_MM * pose[:3, 2]
                device.lead(pose, 1.0 / HAND_HZ)
                if not draws:
                    time.sleep(1.0 / HAND_HZ)
                    continue
                seen = path_view(scenario, head, path, passed % path.duration_s, size)
                if number % CUT_EVERY == 0:
                    place = pose[:3, 3] - AHEAD_MM * pose[:3, 2]
                    solid = solids.capsule(place, place, CUT_MM)
                    edit = patient.carve(solid, CuttingLimits(20.0, 1.0))
                    if edit is not None:
                        change = operation.pushing.follow(edit.change)
                        view.apply([change])
                        copies.follow([change])
                view.draw(seen, number=number, elapsed_s=1.0 / 60.0)
                number += 1
            figures = loop.figures()
        return _measured(figures, number / self._seconds)


def _measured(figures: LoopFigures, frames_s: float) -> Measured:
    """Report how late 99 of 100 ticks were at most; CPU time of one."""
    p50, p99, p999 = figures.late_us
    ticks = figures.ticks + figures.missed
    cpu_s = figures.share * PERIOD_S
    counters = {
        "late_us_50_percent": p50,
        "late_us_99_percent": p99,
        "late_us_99.9_percent": p999,
        "missed_share": figures.missed / max(ticks, 1),
        "share_of_a_core": figures.share,
        "tick_us": figures.tick_us,
        "dearest_tick_us": figures.dearest_us,
        "frames_per_s": frames_s,
    }
    timing = Timing(p99 * 1e-6, p99 * 1e-6, cpu_s, figures.ticks)
    return Measured(timing, counters=counters)
