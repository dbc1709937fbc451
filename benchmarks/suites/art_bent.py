"""Bent rays of the Active Ray Tracer: what deflectors cost."""

import numpy as np

from benchmarks.plan import Measured, Plan, Task
from benchmarks.scenes import SubjectSource, subjects
from benchmarks.timing import measure
from renderers.art import ActiveRayTracer, Quality
from renderers.scene import Projection
from renderers.scene.deflection import Cut, Deflection, Translation

QUALITY = "snapshot"


class BentPlan(Plan, suite="art-bent"):
    """List and make the measurements of suite `art-bent`."""

    def __init__(self, quick: bool) -> None:
        super().__init__(quick)
        self._size = 192 if quick else 512
        self._budget_s = 0.3 if quick else 3.0
        self._subjects = subjects(quick)[: 1 if quick else None]

    def tasks(self) -> list[Task]:
        """List the tasks, baselines first."""
        return [task for source in self._subjects for task in self._bent(source)]

    def _bent(self, source: SubjectSource) -> list[Task]:
        """Compare bent rays with straight ones: the same picture size and quality."""
        quality = Quality.named(QUALITY)

        def draw(deflection: Deflection | None) -> Measured:
            subject = source.subject
            camera = subject.views["inside"].camera(self._size, Projection.PERSPECTIVE)
            tracer = ActiveRayTracer(
                subject.scene, quality, threads=1, deflection=deflection
            )
            timing, _ = measure(lambda: tracer.render(camera), budget_s=self._budget_s)
            assert tracer.report is not None
            counters = {key: float(n) for key, n in tracer.report.counters.items()}
            return Measured(timing, counters=counters)

        return self.compared(
            f"{source.name}/inside/deflected",
            {
                "straight rays": lambda: draw(None),
                "bent rays": lambda: draw(pulled_and_cut(source)),
            },
            {
                "size": self._size,
                "step_voxels": quality.step_voxels,
                "threads": 1,
                "lens": "perspective",
            },
        )


def pulled_and_cut(source: SubjectSource) -> Deflection:
    """Pull and cut tissue half way to what the view inside looks at."""
    view = source.subject.views["inside"]
    way = view.target_mm - view.eye_mm
    middle, radius_mm = view.eye_mm + 0.5 * way, 0.25 * float(np.linalg.norm(way))
    aside = np.cross(way / np.linalg.norm(way), (0.0, 0.0, 1.0))
    return Deflection(
        (
            Translation(middle, radius_mm, 0.3 * radius_mm * aside),
            Cut(middle, radius_mm, aside, 0.2 * radius_mm),
        )
    )
