"""Splats of mode `classic` beside VTK's: the same splats, the same view, one run."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from benchmarks.peers.peer_jobs import splat_job
from benchmarks.peers.peer_process import PeerProcess
from benchmarks.plan import Measured, Task
from benchmarks.references import REFERENCE_NAME, rgb_over_black
from benchmarks.scenes import SubjectSource
from benchmarks.schema import Setting
from benchmarks.timing import measure
from renderers.fsr import FuzzySetRenderer
from renderers.fsr.splats import SplatMode, SplatRasterizer
from renderers.scene import Camera, Image, Projection, image_error
from renderers.scene.thread_team import ThreadTeam

PEER = "VTK splats, depth-sorted"

Renderers = Callable[[SubjectSource, int], FuzzySetRenderer]
"""Gives the renderer of a subject for a number of threads."""


class SplatTasks:
    """Make the tasks of one suite that draw splats.

    size: of the pictures, in pixels. budget_s: for the repeats of one measurement.
    """

    def __init__(
        self, suite: str, renderers: Renderers, peer: PeerProcess, budget_s: float
    ) -> None:
        self._suite = suite
        self._renderers = renderers
        self._peer = peer
        self._budget_s = budget_s

    def beside_vtk(self, source: SubjectSource, view: str, size: int) -> list[Task]:
        """Measure all modes on one thread, VTK's splats as baseline."""
        rows = [
            self._task(source, view, size, mode, 1, f"FSR {mode.value}", PEER)
            for mode in SplatMode
        ]
        case = _case(source, view)
        settings = _settings(size, 1) | {"series": PEER, "bits_read_back": 8}
        peer = Task(
            self._suite, case, PEER, lambda: self._vtk(source, view, size), settings
        )
        return [peer, *rows]

    def on_two_threads(self, source: SubjectSource, view: str, size: int) -> list[Task]:
        """Measure two threads, alone and culling one view ahead, against one."""
        mode = SplatMode.GAUSSIAN
        one = f"FSR {mode.value}"
        return [
            self._task(source, view, size, mode, 2, f"{one}, {name}", one, is_film)
            for name, is_film in (("2 threads", False), ("2 threads, film", True))
        ]

    def in_two_stages(self, source: SubjectSource, view: str, size: int) -> list[Task]:
        """Measure one thread that draws while another culls, against drawing alone.

        As in 1995, where one process culled and another drew. Culling is hidden where
        the two take equally long.
        """
        mode = SplatMode.GAUSSIAN
        alone = f"FSR {mode.value}, drawing alone"
        meanwhile = f"FSR {mode.value}, culled meanwhile"
        return [
            self._stage(source, view, size, mode, name, alone, is_film)
            for name, is_film in ((alone, False), (meanwhile, True))
        ]

    def _stage(
        self,
        source: SubjectSource,
        view: str,
        size: int,
        mode: SplatMode,
        name: str,
        alone: str,
        is_film: bool,
    ) -> Task:
        def draw() -> Measured:
            renderer = self._renderers(source, 1)
            rasterizer = SplatRasterizer(renderer.fuzzy_set, renderer.scene)
            camera = _pinhole(source, view, size)
            team = ThreadTeam(1)
            if is_film:
                views = iter(lambda: (camera, mode), None)
                film = rasterizer.film(views, team)
                timing, image = measure(lambda: next(film), budget_s=self._budget_s)
                film.close()
            else:
                splats = rasterizer.prepare(camera, mode)
                timing, image = measure(
                    lambda: rasterizer.draw_list(splats, team), budget_s=self._budget_s
                )
            culling, _ = measure(
                lambda: rasterizer.prepare(camera, mode), budget_s=self._budget_s
            )
            counters = {"culling, ms": 1e3 * culling.min_s}
            made = Measured(timing, counters=counters)
            return self._compare(source, view, size, rgb_over_black(image.rgba), made)

        return Task(
            self._suite,
            _case(source, view),
            name,
            draw,
            _settings(size, 1) | {"series": name},
            baseline=alone if is_film else f"FSR {mode.value}",
            clock="wall",
        )

    def _task(
        self,
        source: SubjectSource,
        view: str,
        size: int,
        mode: SplatMode,
        threads: int,
        name: str,
        baseline: str,
        is_film: bool = False,
    ) -> Task:
        def draw() -> Measured:
            renderer = self._renderers(source, threads)
            renderer.mode = mode
            camera = _pinhole(source, view, size)
            # one picture of many: each is culled while another is drawn
            film = renderer.film(iter(lambda: camera, None))

            def picture() -> Image:
                return next(film) if is_film else renderer.render(camera)

            timing, image = measure(picture, budget_s=self._budget_s)
            counters = {key: float(n) for key, n in renderer.counters.items()}
            if counters["fragments"]:
                ns = 1e9 / counters["fragments"]
                counters["ns per fragment, frame"] = timing.cpu_s * ns
            made = Measured(timing, counters=counters)
            return self._compare(source, view, size, rgb_over_black(image.rgba), made)

        return Task(
            self._suite,
            _case(source, view),
            name,
            draw,
            _settings(size, threads) | {"series": name},
            baseline=baseline,
            clock="cpu" if threads == 1 else "wall",
        )

    def _vtk(self, source: SubjectSource, view: str, size: int) -> Measured:
        renderer = self._renderers(source, 1)
        job = splat_job(
            self._peer,
            source.subject.scene,
            renderer.fuzzy_set,
            _pinhole(source, view, size),
            self._budget_s,
        )
        answer = self._peer.ask(job)
        counters = {"splats": float(len(renderer.fuzzy_set))}
        made = Measured(answer.timing, counters=counters)
        return self._compare(source, view, size, self._peer.picture(answer), made)

    def _compare(
        self,
        source: SubjectSource,
        view: str,
        size: int,
        picture: NDArray[np.float32],
        made: Measured,
    ) -> Measured:
        camera = _pinhole(source, view, size)
        reference = source.references.picture(
            view, "shaded", lambda: source.subject.scene, camera
        )
        error = image_error(picture, reference)
        return Measured(made.timing, error, "linear", made.counters)


def _case(source: SubjectSource, view: str) -> str:
    return f"{source.name}/{view}/shaded"


def _settings(size: int, threads: int) -> dict[str, Setting]:
    return {
        "size": size,
        "threads": threads,
        "lens": "perspective",
        "reference": REFERENCE_NAME,
    }


def _pinhole(source: SubjectSource, view: str, size: int) -> Camera:
    return source.subject.views[view].camera(size, Projection.PERSPECTIVE)
