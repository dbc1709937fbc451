"""The Fuzzy-Set Renderer: splats beside VTK's, the surface and the finished picture."""

from collections.abc import Callable
from contextlib import closing
from functools import partial

import numpy as np

from benchmarks.plan import Measured, Task
from benchmarks.references import SURFACE_NAME, depth_error, surface_counters
from benchmarks.scenes import VIEWS, SubjectSource, subjects
from benchmarks.schema import Setting
from benchmarks.suites.splat_plan import SplatPlan
from benchmarks.timing import measure
from renderers.art import ActiveRayTracer
from renderers.scene import Camera, GBuffer, Projection, Renderer, image_error, ssim
from renderers.shading import CameraPass, ScopeLight, ScopeShader, Tier, scope_picture

ART_SURFACE = "ART snapshot, step 0.5"
SCOPE_SIZE = 512
FULL_SIZE = 512
QUICK_SIZE = 192


class FsrPlan(SplatPlan, suite="fsr"):
    """List and make the measurements of suite `fsr`."""

    def __init__(self, quick: bool) -> None:
        super().__init__(quick)
        self._size = QUICK_SIZE if quick else FULL_SIZE
        self._subjects = subjects(quick)

    def tasks(self) -> list[Task]:
        """List the tasks, baselines first."""
        found = []
        for source in self._subjects:
            for view in VIEWS:
                found += self.beside_vtk(source, view, self._size)
                found += self._surface(source, view)
            found += self._picture(source)
        return found

    def _scope(self, source: SubjectSource, view: str) -> Camera:
        return source.subject.views[view].camera(SCOPE_SIZE, Projection.EQUIDISTANT)

    def _surface(self, source: SubjectSource, view: str) -> list[Task]:
        settings: dict[str, Setting] = {
            "size": SCOPE_SIZE,
            "threads": 1,
            "lens": "equidistant",
            "reference": SURFACE_NAME,
        }

        def find(draw: Callable[[Camera], GBuffer]) -> Measured:
            camera = self._scope(source, view)
            timing, found = measure(lambda: draw(camera), budget_s=self.budget_s)
            reference = source.references.gbuffer(
                view, lambda: source.subject.scene, camera
            )
            error = depth_error(found, reference)
            return Measured(timing, error, "mm", surface_counters(found, reference))

        def rays() -> Measured:
            return find(ActiveRayTracer(source.subject.scene, threads=1).gbuffer)

        def splats() -> Measured:
            return find(self.renderer(source, 1).gbuffer)

        case, own = f"{source.name}/{view}/surface", "FSR surfels"
        traced: dict[str, Setting] = {"series": "ART", "step_voxels": 0.5}
        return [
            self.task(case, ART_SURFACE, rays, settings | traced),
            self.task(case, own, splats, settings | {"series": own}, ART_SURFACE),
        ]

    def _picture(self, source: SubjectSource) -> list[Task]:
        """Measure the finished endoscope picture, which an `inside` view only has."""
        case = f"{source.name}/inside/picture"
        ray, one, two = (
            "ART live, 1 thread",
            "FSR live, 1 thread",
            "FSR live, 2 threads",
        )

        def draw(threads: int, surface: str) -> Measured:
            camera = self._scope(source, "inside")
            scene = source.subject.scene
            renderer: Renderer = (
                ActiveRayTracer(scene, threads=threads)
                if surface == "ART"
                else self.renderer(source, threads)
            )
            assert scene.surface is not None
            with (
                closing(ScopeShader(scene.surface, Tier.LIVE, threads=threads)) as lit,
                closing(CameraPass(threads=threads)) as lens,
            ):
                finish = partial(
                    scope_picture,
                    camera=camera,
                    shader=lit,
                    camera_pass=lens,
                    light=ScopeLight(),
                )
                truth = source.references.gbuffer("inside", lambda: scene, camera)
                reference, gain = finish(truth)
                timing, (picture, _) = measure(
                    lambda: finish(renderer.gbuffer(camera), gain=gain),
                    budget_s=self.budget_s,
                )
            return Measured(
                timing,
                image_error(
                    picture.astype(np.float32) / 255, reference.astype(np.float32) / 255
                ),
                "sRGB",
                {
                    "frames_per_s": 1 / timing.min_s,
                    "frames_per_cpu_s": 1 / timing.cpu_s,
                    "ssim": ssim(picture, reference),
                },
            )

        def settings(threads: int, series: str) -> dict[str, Setting]:
            return {
                "size": SCOPE_SIZE,
                "threads": threads,
                "lens": "equidistant",
                "tier": "LIVE",
                "series": series,
                "reference": f"{SURFACE_NAME}, same shading and gain",
            }

        return [
            self.task(case, ray, lambda: draw(1, "ART"), settings(1, ray)),
            self.task(
                case, one, lambda: draw(1, "FSR"), settings(1, one), baseline=ray
            ),
            self.task(
                case,
                two,
                lambda: draw(2, "FSR"),
                settings(2, two),
                baseline=one,
                clock="wall",
            ),
        ]
