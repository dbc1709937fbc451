"""The phantom: time against voxel size and against error, memory."""

import tracemalloc

import numpy as np

from anatomy import PhantomParameters, build_phantom, distance_at, hazard_distances
from anatomy.phantom.air import default_threads
from anatomy.phantom.phantom import Phantom
from benchmarks.phantom_figures.sinus_volumes import surface_errors_mm
from benchmarks.plan import Measured, Plan, Task
from benchmarks.timing import measure
from renderers.scene import Volume

WHOLE = "whole head"
QUERIES = "queries at points"
POINTS = 20_000
HEAD = PhantomParameters()


class AnatomyPlan(Plan, suite="anatomy"):
    """List and make the measurements of suite `anatomy`."""

    def __init__(self, quick: bool) -> None:
        super().__init__(quick)
        self._spacings = (2.0, 1.0) if quick else (1.0, 0.5, 0.35, 0.3)
        self._budget_s = 0.5 if quick else 3.0
        self._rng = np.random.default_rng(0)

    def tasks(self) -> list[Task]:
        """List the tasks, baselines first."""
        found = [self._head(spacing) for spacing in self._spacings]
        found += [self._points("air distance"), self._points("hazards")]
        return found

    def _head(self, spacing: float) -> Task:
        def run() -> Measured:
            timing, _ = measure(
                lambda: build_phantom(HEAD, spacing), budget_s=self._budget_s
            )
            tracemalloc.start()
            phantom = build_phantom(HEAD, spacing)
            _, peak = tracemalloc.get_traced_memory()
            tracemalloc.stop()
            size = output_bytes(phantom)
            errors_um = 1e3 * surface_errors_mm(phantom)
            return Measured(
                timing,
                counters={
                    "voxels": float(phantom.ct.values.size),
                    "peak memory / output": peak / size,
                    "surface error median um": float(np.median(errors_um)),
                    "surface error p90 um": float(np.percentile(errors_um, 90)),
                },
            )

        return self.task(
            WHOLE,
            f"{spacing:g} mm",
            run,
            {"spacing_mm": spacing, "threads": default_threads()},
            clock="wall",
            cost_s=6.0 + 4.0 / spacing**3,
        )

    def _points(self, mode: str) -> Task:
        points = self._rng.uniform([-40, -20, -10], [40, 78, 76], (POINTS, 3))
        ask = distance_at if mode == "air distance" else hazard_distances

        def run() -> Measured:
            timing, _ = measure(lambda: ask(HEAD, points), budget_s=self._budget_s)
            rate = POINTS / timing.min_s
            return Measured(timing, counters={"points per second": rate})

        return self.task(QUERIES, mode, run, {"points": POINTS}, cost_s=5.0)


def output_bytes(phantom: Phantom) -> int:
    """Sum the bytes of a phantom's volumes."""
    volumes = (getattr(phantom, name) for name in phantom.__slots__)
    return sum(v.values.nbytes for v in volumes if isinstance(v, Volume))
