"""Leaving out what walls hide: nothing, by cones every frame, by sets found once."""

from functools import cached_property, partial

import numpy as np

from benchmarks.losslessness import COMPARED, DIFFER, differing, share_error
from benchmarks.nasal_views import bundled_flight
from benchmarks.plan import Measured, Plan, Task
from benchmarks.scenes import SubjectSource, subjects
from benchmarks.schema import Setting
from benchmarks.timing import measure
from renderers.fsr.surfels import SurfelRasterizer
from renderers.fsr.visibility import VisibleSets, build_visible_sets
from renderers.scene import Camera, Volume
from renderers.scene.thread_pool import ThreadPool
from scenarios import tip_frame

NOTHING = "all blocks in view"
CONES = "cones every frame"
SETS = "sets found once"
BUILD = "finding the sets"
SKIPS: dict[str, Setting] = {"skips": "surfels that walls hide"}
SIZE = 512
VIEWS = 24
QUICK_VIEWS = 4
FIRST_S, LAST_S = 2.0, 23.0
"""Where the bundled flight is inside the nose."""


class VisibilityPlan(Plan, suite="visibility"):
    """List and make the measurements of suite `visibility`."""

    def __init__(self, quick: bool) -> None:
        super().__init__(quick)
        self._source: SubjectSource = subjects(quick)[0]
        self._views = QUICK_VIEWS if quick else VIEWS
        self._budget_s = 0.3 if quick else 3.0
        self._pool = ThreadPool(1)
        self.stack.callback(self._pool.close)

    def tasks(self) -> list[Task]:
        """List the tasks, baselines first."""
        settings: dict[str, Setting] = {
            "size": SIZE,
            "threads": 1,
            "views": self._views,
            "reference": NOTHING,
        }
        case, runs = f"{self._source.name}/path/surface", (NOTHING, CONES, SETS)
        return [
            self.task(
                case,
                mode,
                partial(self._draw, mode),
                settings | {"series": mode} | ({} if mode == NOTHING else SKIPS),
                baseline=None if mode == NOTHING else NOTHING,
                cost_s=20.0,
            )
            for mode in runs
        ] + [
            self.task(
                f"{self._source.name}/airway/sets",
                BUILD,
                self._build,
                {"threads": 1, "series": BUILD},
                cost_s=60.0,
            )
        ]

    @cached_property
    def _distance(self) -> Volume:
        surface = self._source.subject.scene.surface
        assert surface is not None
        return surface.distance

    @cached_property
    def _cameras(self) -> list[Camera]:
        scenario, path = bundled_flight()
        scope = scenario.scope.endoscope()
        cameras = []
        for time_s in np.linspace(FIRST_S, LAST_S, self._views):
            at = path.sample(float(time_s))
            pose = tip_frame(at.tip_mm, at.axis)
            cameras.append(scope.camera(pose, at.roll_deg, (SIZE, SIZE)))
        return cameras

    @cached_property
    def _sets(self) -> VisibleSets:
        return build_visible_sets(self._distance, self._bare.bounds(), self._pool)

    @cached_property
    def _bare(self) -> SurfelRasterizer:
        return SurfelRasterizer(self._distance, hide=False)

    def _draw(self, mode: str) -> Measured:
        """Time all views together; the error counts pixels that are not the same."""
        rasterizer = self._bare
        if mode != NOTHING:
            rasterizer = SurfelRasterizer(self._distance)
        if mode == SETS:
            rasterizer.use_visible_sets(self._sets)
        looked_up = 0.0
        compared = other = 0
        listed = 0
        for camera in self._cameras:
            found = rasterizer.draw(camera, self._pool)
            listed += rasterizer.counters["listed"]
            looked_up += rasterizer.counters["looked up"]
            wanted = self._bare.draw(camera, self._pool)
            compared += wanted.depth_mm.size
            other += differing(found.depth_mm, wanted.depth_mm)
        timing, _ = measure(
            lambda: [rasterizer.draw(c, self._pool) for c in self._cameras],
            budget_s=self._budget_s,
        )
        return Measured(
            timing,
            share_error(other / compared),
            "share of pixels",
            {
                "ms_per_view": timing.cpu_s / self._views * 1e3,
                "surfels_listed": listed / self._views,
                "views_looked_up": looked_up,
                COMPARED: compared,
                DIFFER: other,
            },
        )

    def _build(self) -> Measured:
        timing, sets = measure(
            lambda: build_visible_sets(self._distance, self._bare.bounds(), self._pool),
            least=1,
            most=1,
        )
        return Measured(
            timing,
            counters={
                "boxes": len(sets.bits),
                "blocks": len(sets.numbers),
                "share_kept": sets.share,
                "megabytes": sets.bits.nbytes / 1e6,
            },
        )
