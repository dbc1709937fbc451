"""How the splatter's cost grows: with splats and pixels.

Each sweep changes one quantity; the report fits a power to its times. The head is seen
from outside, where every splat is in the picture.
"""

from functools import partial

from benchmarks.plan import Measured, Plan, Task
from benchmarks.scenes import SubjectSource, phantom_subject
from benchmarks.suites.splats import threshold_for
from benchmarks.timing import measure
from renderers.fsr import FuzzySetRenderer
from renderers.fsr.splats import SplatMode
from renderers.scene import Projection

VIEW = "outside"
SPACING_MM, QUICK_SPACING_MM = 0.64, 1.45
SPLATS, QUICK_SPLATS = (62_500, 125_000, 250_000, 500_000), (12_500, 25_000, 50_000)
PICTURES, QUICK_PICTURES = (128, 256, 512, 1024), (128, 256, 512)
USUAL_PICTURE = 512


class FsrGrowthPlan(Plan, suite="fsr-growth"):
    """List and make the measurements of suite `fsr-growth`."""

    def __init__(self, quick: bool) -> None:
        super().__init__(quick)
        self._budget_s = 0.3 if quick else 2.0
        self._splats = QUICK_SPLATS if quick else SPLATS
        self._pictures = QUICK_PICTURES if quick else PICTURES
        spacing_mm = QUICK_SPACING_MM if quick else SPACING_MM
        self._source = SubjectSource("phantom", lambda: phantom_subject(spacing_mm))
        self._renderers: dict[int, FuzzySetRenderer] = {}

    def tasks(self) -> list[Task]:
        """List the sweeps."""
        usual = self._splats[-1]
        found = []
        for mode in (SplatMode.GAUSSIAN, SplatMode.POINTS):
            task = partial(self._task, mode)
            found += [task("splats", n, n, USUAL_PICTURE) for n in self._splats]
            found += [task("pixels", n**2, usual, n) for n in self._pictures]
        return found

    def _task(
        self, mode: SplatMode, sweep: str, amount: int, count: int, size: int
    ) -> Task:
        series = f"FSR {mode.value}"
        return self.task(
            f"{self._source.name}/{VIEW}/{series}, {sweep}",
            f"{amount}",
            partial(self._picture, mode, count, size),
            {"threads": 1, "series": series, "grows_with": sweep, "amount": amount},
        )

    def _renderer(self, count: int) -> FuzzySetRenderer:
        if count not in self._renderers:
            scene = self._source.subject.scene
            made = self._renderers[count] = FuzzySetRenderer(
                scene, threshold=threshold_for(scene, count), threads=1
            )
            self.stack.callback(made.close)
        return self._renderers[count]

    def _picture(self, mode: SplatMode, count: int, size: int) -> Measured:
        renderer = self._renderer(count)
        renderer.mode = mode
        view = self._source.subject.views[VIEW]
        camera = view.camera(size, Projection.PERSPECTIVE)
        timing, _ = measure(lambda: renderer.render(camera), budget_s=self._budget_s)
        counters = {key: float(n) for key, n in renderer.counters.items()}
        return Measured(timing, counters=counters)
