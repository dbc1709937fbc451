"""What the ray tracer leaves out since it is clear: what that saves, bit for bit."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from benchmarks.losslessness import COMPARED, DIFFER, differing
from benchmarks.plan import Measured, Plan, Task
from benchmarks.scenes import CLASSIC_QUANTITIES, VIEWS, SubjectSource, subjects
from benchmarks.schema import Setting
from benchmarks.timing import measure
from renderers.art import ActiveRayTracer, Quality
from renderers.scene import Projection

QUALITY = "snapshot"
EVERYWHERE = "ART, every sample taken"
LEAPING = "ART, clear space leapt over"


class SkippingPlan(Plan, suite="skipping"):
    """List and make the measurements of suite `skipping`."""

    def __init__(self, quick: bool) -> None:
        super().__init__(quick)
        self._size = 192 if quick else 512
        self._budget_s = 0.3 if quick else 3.0
        self._subjects = subjects(quick)

    def tasks(self) -> list[Task]:
        """List the tasks, without skipping first."""
        return [
            task
            for source in self._subjects
            for view in VIEWS
            for quantity in (*CLASSIC_QUANTITIES, "surface")
            for task in self._both(source, view, quantity)
        ]

    def _both(self, source: SubjectSource, view: str, quantity: str) -> list[Task]:
        case = f"{source.name}/{view}/{quantity}"
        settings: dict[str, Setting] = {
            "size": self._size,
            "step_voxels": Quality.named(QUALITY).step_voxels,
            "threads": 1,
        }
        run = partial(self._measure, source, view, quantity)
        leaping = settings | {"skips": "samples in clear space"}
        return [
            self.task(case, EVERYWHERE, partial(run, False), settings),
            self.task(case, LEAPING, partial(run, True), leaping, baseline=EVERYWHERE),
        ]

    def _measure(
        self, source: SubjectSource, view: str, quantity: str, leaping: bool
    ) -> Measured:
        quality = replace(Quality.named(QUALITY), skip_empty=leaping)
        tracer, draw = self._drawing(source, view, quantity, quality)
        timing, found = measure(draw, budget_s=self._budget_s)
        assert tracer.report is not None
        counters = {"samples": float(tracer.report.counters["samples"])}
        if leaping:
            plain = replace(quality, skip_empty=False)
            _, everywhere = self._drawing(source, view, quantity, plain)
            counters |= {COMPARED: found.size, DIFFER: differing(found, everywhere())}
        return Measured(timing, counters=counters)

    def _drawing(
        self, source: SubjectSource, view: str, quantity: str, quality: Quality
    ) -> tuple[ActiveRayTracer, Callable[[], NDArray[np.float32]]]:
        """Return a tracer, and what draws a picture or the depths of a surface."""
        subject, place = source.subject, source.subject.views[view]
        if quantity == "surface":
            tracer = ActiveRayTracer(subject.scene, quality, threads=1)
            lens = place.camera(self._size, Projection.EQUIDISTANT)
            return tracer, lambda: tracer.gbuffer(lens).depth_mm
        tracer = ActiveRayTracer(subject.in_mode(quantity), quality, threads=1)
        pinhole = place.camera(self._size, Projection.PERSPECTIVE)
        return tracer, lambda: tracer.render(pinhole).rgba
