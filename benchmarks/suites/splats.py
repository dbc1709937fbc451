"""Mode `classic` at the sizes of 1995 and ten times that: 50,000 and 500,000 splats."""

from functools import partial

import numpy as np

from benchmarks.plan import Task
from benchmarks.scenes import SubjectSource, phantom_subject
from benchmarks.suites.splat_plan import SplatPlan
from renderers.fsr import FuzzySetRenderer, extract_fuzzy_set
from renderers.fsr.fuzzy_set import BOUNDARY_THRESHOLD, default_inclusion
from renderers.scene import Scene
from system import UserError

SPLAT_VIEWS = ("nasopharynx", "outside")
"""No splat is nearer to either eye than several times its own width. At the nasal valve
of `VIEWS`, 2.8 mm wide, an eye among splats of 1.45 mm sees blurs that fill the
picture, whose error measures nothing."""

SETS = ((50_000, 1.45), (500_000, 0.64))
"""Splats, and the spacing (mm) of a phantom that has somewhat more of them."""

SIZE = 512


class SplatsPlan(SplatPlan, suite="splats"):
    """List and make the measurements of suite `splats`."""

    def __init__(self, quick: bool) -> None:
        super().__init__(quick)
        self._wanted: dict[str, int] = {}

    def tasks(self) -> list[Task]:
        """List the tasks, baselines first; a quick run has one set."""
        found: list[Task] = []
        for count, spacing_mm in SETS[:1] if self.quick else SETS:
            name = f"phantom_{count // 1000}k"
            source = SubjectSource(name, partial(phantom_subject, spacing_mm))
            self._wanted[name] = count
            for view in SPLAT_VIEWS[:1] if self.quick else SPLAT_VIEWS:
                found += self.beside_vtk(source, view, SIZE)
                found += self.on_two_threads(source, view, SIZE)
        return found

    def make_renderer(self, source: SubjectSource, threads: int) -> FuzzySetRenderer:
        """Draw as many splats as are wanted."""
        scene = source.subject.scene
        threshold = threshold_for(scene, self._wanted[source.name])
        return FuzzySetRenderer(scene, threshold=threshold, threads=threads)


def threshold_for(scene: Scene, count: int) -> float:
    """Find the threshold at which a scene's default set has so many splats.

    The count is exact but for equal values of F. Raises UserError where the default
    threshold already gives fewer.
    """
    whole = extract_fuzzy_set(
        scene.volume, default_inclusion(scene), BOUNDARY_THRESHOLD
    )
    if len(whole) < count:
        raise UserError(f"wanted {count} splats, but there are only {len(whole)}")
    return float(np.partition(whole.inclusion, len(whole) - count)[-count])
