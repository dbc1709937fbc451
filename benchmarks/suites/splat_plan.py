"""Splats of mode `classic` beside VTK's: the same splats, the same view, one run."""

from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.typing import NDArray

from benchmarks.peers.peer_jobs import splat_job
from benchmarks.peers.peer_process import PeerProcess
from benchmarks.plan import Measured, Plan, Task
from benchmarks.references import REFERENCE_NAME, rgb_over_black
from benchmarks.scenes import SubjectSource
from benchmarks.schema import Setting
from benchmarks.timing import Timing, measure
from renderers.fsr import FuzzySetRenderer
from renderers.fsr.splats import SplatMode
from renderers.scene import Camera, Image, Projection, image_error

PEER = "VTK splats, depth-sorted"
GAUSSIAN = f"FSR {SplatMode.GAUSSIAN.value}"


class SplatPlan(Plan):
    """Be a suite that draws splats. budget_s: for the repeats of one measurement."""

    def __init__(self, quick: bool) -> None:
        super().__init__(quick)
        self.budget_s = 0.3 if quick else 3.0
        self._peer = PeerProcess("benchmarks.peers.vtk_splats")
        self.stack.callback(self._peer.close)
        self._renderers: dict[tuple[str, int], FuzzySetRenderer] = {}

    def renderer(self, source: SubjectSource, threads: int) -> FuzzySetRenderer:
        """Return what draws a subject, made once."""
        key = source.name, threads
        if key not in self._renderers:
            made = self._renderers[key] = self.make_renderer(source, threads)
            self.stack.callback(made.close)
        return self._renderers[key]

    def make_renderer(self, source: SubjectSource, threads: int) -> FuzzySetRenderer:
        """Make what draws a subject."""
        return FuzzySetRenderer(source.subject.scene, threads=threads)

    def beside_vtk(self, source: SubjectSource, view: str, size: int) -> list[Task]:
        """Measure all modes on one thread, VTK's splats as baseline."""
        task = partial(self._splats, source, view, size)
        rows = [
            task(f"FSR {mode.value}", partial(self._draw, mode, 1, False), PEER)
            for mode in SplatMode
        ]
        return [task(PEER, self._vtk, None, bits_read_back=8), *rows]

    def on_two_threads(self, source: SubjectSource, view: str, size: int) -> list[Task]:
        """Measure two threads, alone and culling one view ahead, against one."""
        return [
            self._splats(
                source,
                view,
                size,
                f"{GAUSSIAN}, {name}",
                partial(self._draw, SplatMode.GAUSSIAN, 2, is_film),
                GAUSSIAN,
                threads=2,
            )
            for name, is_film in (("2 threads", False), ("2 threads, film", True))
        ]

    def _splats(
        self,
        source: SubjectSource,
        view: str,
        size: int,
        name: str,
        draw: Callable[
            [SubjectSource, Camera],
            tuple[Timing, NDArray[np.float32], dict[str, float]],
        ],
        baseline: str | None,
        *,
        threads: int = 1,
        **further: Setting,
    ) -> Task:
        """Make a task; draw: gives times, a picture and counters."""

        def run() -> Measured:
            subject = source.subject
            camera = subject.views[view].camera(size, Projection.PERSPECTIVE)
            timing, picture, counters = draw(source, camera)
            reference = source.references.picture(
                view, "shaded", lambda: subject.scene, camera
            )
            error = image_error(picture, reference)
            return Measured(timing, error, "linear", counters)

        settings: dict[str, Setting] = {
            "size": size,
            "threads": threads,
            "lens": "perspective",
            "reference": REFERENCE_NAME,
            "series": name,
        }
        return self.task(
            f"{source.name}/{view}/shaded",
            name,
            run,
            settings | further,
            baseline,
            clock="wall" if threads > 1 else "cpu",
        )

    def _draw(
        self,
        mode: SplatMode,
        threads: int,
        is_film: bool,
        source: SubjectSource,
        camera: Camera,
    ) -> tuple[Timing, NDArray[np.float32], dict[str, float]]:
        renderer = self.renderer(source, threads)
        renderer.mode = mode
        # one picture of many: each is culled while another is drawn
        film = renderer.film(iter(lambda: camera, None))

        def picture() -> Image:
            return next(film) if is_film else renderer.render(camera)

        timing, image = measure(picture, budget_s=self.budget_s)
        counters = {key: float(n) for key, n in renderer.counters.items()}
        return timing, rgb_over_black(image.rgba), counters

    def _vtk(
        self, source: SubjectSource, camera: Camera
    ) -> tuple[Timing, NDArray[np.float32], dict[str, float]]:
        splats, peer = self.renderer(source, 1).fuzzy_set, self._peer
        job = splat_job(peer, source.subject.scene, splats, camera, self.budget_s)
        answer = peer.ask(job)
        return answer.timing, peer.picture(answer), {"splats": float(len(splats))}
