"""The Fuzzy-Set Renderer: splats beside VTK's, the surface and the finished picture."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from benchmarks.peers.peer_process import PeerProcess
from benchmarks.plan import Measured, Plan, Task
from benchmarks.references import (
    SURFACE_NAME,
    depth_error,
    surface_counters,
)
from benchmarks.scenes import VIEWS, SubjectSource, subjects
from benchmarks.schema import Setting
from benchmarks.suites.splat_tasks import SplatTasks
from benchmarks.timing import measure
from renderers.art import ActiveRayTracer
from renderers.fsr import FuzzySetRenderer
from renderers.scene import Camera, GBuffer, Projection, image_error, ssim
from renderers.shading import CameraPass, ScopeLight, ScopeShader, Tier, scope_picture

ART_SURFACE = "ART snapshot, step 0.5"
SCOPE_SIZE = 512
FULL_SIZE = 512
QUICK_SIZE = 192


class FsrPlan(Plan, suite="fsr"):
    """List and make the measurements of suite `fsr`."""

    def __init__(self, quick: bool) -> None:
        self._size = QUICK_SIZE if quick else FULL_SIZE
        self._budget_s = 0.3 if quick else 3.0
        self._subjects = subjects(quick)
        self._peer = PeerProcess("benchmarks.peers.vtk_splats")
        self._renderers: dict[tuple[str, int], FuzzySetRenderer] = {}
        self._draw = SplatTasks("fsr", self._renderer, self._peer, self._budget_s)
        self._studios: dict[tuple[str, int], ScopeStudio] = {}

    def tasks(self) -> list[Task]:
        """List the tasks, baselines first."""
        found = []
        for source in self._subjects:
            for view in VIEWS:
                found += self._draw.beside_vtk(source, view, self._size)
                found += self._surface(source, view)
            found += self._picture(source)
        return found

    def close(self) -> None:
        """End the peer and all threads."""
        self._peer.close()
        for renderer in self._renderers.values():
            renderer.close()
        for studio in self._studios.values():
            studio.close()

    def _renderer(self, source: SubjectSource, threads: int) -> FuzzySetRenderer:
        key = source.name, threads
        if key not in self._renderers:
            self._renderers[key] = FuzzySetRenderer(
                source.subject.scene, threads=threads
            )
        return self._renderers[key]

    def _scope(self, source: SubjectSource, view: str) -> Camera:
        return source.subject.views[view].camera(SCOPE_SIZE, Projection.EQUIDISTANT)

    def _surface(self, source: SubjectSource, view: str) -> list[Task]:
        settings: dict[str, Setting] = {
            "size": SCOPE_SIZE,
            "threads": 1,
            "lens": "equidistant",
            "reference": SURFACE_NAME,
        }

        def find(gbuffer: Callable[[], Callable[[Camera], GBuffer]]) -> Measured:
            camera = self._scope(source, view)
            draw = gbuffer()
            timing, found = measure(lambda: draw(camera), budget_s=self._budget_s)
            reference = source.references.gbuffer(
                view, lambda: source.subject.scene, camera
            )
            return Measured(
                timing,
                depth_error(found, reference),
                "mm",
                surface_counters(found, reference),
            )

        case = f"{source.name}/{view}/surface"
        return [
            self.task(
                case,
                ART_SURFACE,
                lambda: find(
                    lambda: ActiveRayTracer(source.subject.scene, threads=1).gbuffer
                ),
                settings | {"series": "ART", "step_voxels": 0.5},
            ),
            self.task(
                case,
                "FSR surfels",
                lambda: find(lambda: self._renderer(source, 1).gbuffer),
                settings | {"series": "FSR surfels"},
                baseline=ART_SURFACE,
            ),
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
            studio = self._studio(source, threads)
            reference, gain = studio.finish(
                source.references.gbuffer("inside", lambda: scene, camera),
                camera,
                None,
            )
            gbuffer = (
                ActiveRayTracer(scene, threads=threads).gbuffer
                if surface == "ART"
                else self._renderer(source, threads).gbuffer
            )
            timing, picture = measure(
                lambda: studio.finish(gbuffer(camera), camera, gain)[0],
                budget_s=self._budget_s,
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

    def _studio(self, source: SubjectSource, threads: int) -> "ScopeStudio":
        key = source.name, threads
        if key not in self._studios:
            self._studios[key] = ScopeStudio(source, threads)
        return self._studios[key]


class ScopeStudio:
    """Light and finish G-buffers of one head in tier LIVE."""

    def __init__(self, source: SubjectSource, threads: int) -> None:
        surface = source.subject.scene.surface
        assert surface is not None
        self._shader = ScopeShader(surface, Tier.LIVE, threads=threads)
        self._camera_pass = CameraPass(threads=threads)
        self._light = ScopeLight()

    def finish(
        self, gbuffer: GBuffer, camera: Camera, gain: float | None
    ) -> tuple[NDArray[np.uint8], float]:
        """Return the picture on the monitor, and the gain it was exposed with."""
        return scope_picture(
            gbuffer, camera, self._shader, self._camera_pass, self._light, gain
        )

    def close(self) -> None:
        """End the threads."""
        self._shader.close()
        self._camera_pass.close()
