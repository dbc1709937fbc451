"""The Active Ray Tracer: run time against error, beside VTK's best CPU ray caster."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from benchmarks.peers.volume_peer import PEER, PEER_REFERENCE_NAME, VolumePeer
from benchmarks.plan import Measured, Plan, Task, UnavailableError
from benchmarks.references import (
    REFERENCE_NAME,
    SURFACE_NAME,
    depth_error,
    rgb_over_black,
    surface_counters,
)
from benchmarks.scenes import CLASSIC_QUANTITIES, VIEWS, SubjectSource, subjects
from benchmarks.schema import Clock, Setting
from benchmarks.timing import measure
from renderers.art import ActiveRayTracer, Quality
from renderers.scene import Projection, image_error

QUALITIES = ("preview", "snapshot", "final")
THREADED_QUALITY = "snapshot"
"""Where other cuts, the integrated march and two threads are measured as well."""

PEER_CUTOFF = 255 / 32767
"""The peer ends a ray where less than 255 of 32767 parts of the light are left."""

EQUAL_STEPS = (2.0, 1.41, 1.0, 0.84, 0.71, 0.59, 0.5, 0.42, 0.35, 0.25, 0.18, 0.125)
EQUAL_CUTOFF = 0.02
"""What is tried for no more error than the peer's, from coarse to fine. Rays are
divided by their opacity where they are cut, which lowers these errors (the peer cuts at
0.008 and does not divide)."""

OF_PEER = "of the peer's picture"
OF_PEER_ALONE = f"of the peer's picture, against {PEER_REFERENCE_NAME}"

SURFACE_SIZE = 512


class ArtPlan(Plan, suite="art"):
    """List and make the measurements of suite `art`."""

    def __init__(self, quick: bool) -> None:
        super().__init__(quick)
        self._size = 192 if quick else 512
        self._surface_size = SURFACE_SIZE
        self._budget_s = 0.3 if quick else 3.0
        self._subjects = subjects(quick)
        self._peer = VolumePeer(self._size, self._budget_s)
        self.stack.callback(self._peer.close)

    def tasks(self) -> list[Task]:
        """List the tasks, each view's peer before our own."""
        found = []
        for source in self._subjects:
            for view in VIEWS:
                for quantity in CLASSIC_QUANTITIES[self.quick :]:
                    for quality in QUALITIES:
                        found += self._classic(source, view, quantity, quality)
                found += [self._surface(source, view, name) for name in QUALITIES]
                found.append(self._surface(source, view, "preview", threads=2))
        return found

    def _classic(
        self, source: SubjectSource, view: str, quantity: str, name: str
    ) -> list[Task]:
        # as the peer classifies
        quality = replace(Quality.named(name), classification="post")
        step = quality.step_voxels
        case = f"{source.name}/{view}/{quantity}"
        peer, own = f"{PEER}, step {step:g}", f"ART {name}, step {step:g}"
        series, reference = PEER, REFERENCE_NAME
        peers_own: dict[str, Setting] = {}
        if quantity == "shaded":
            series = f"{PEER}, against itself"
            reference = PEER_REFERENCE_NAME
            peers_own["self_referenced"] = True

        def task(
            mode: str,
            measured: Callable[[], Measured],
            baseline: str | None = peer,
            **settings: Setting,
        ) -> Task:
            ours: dict[str, Setting] = {
                "size": self._size,
                "threads": 1,
                "lens": "perspective",
                "reference": REFERENCE_NAME,
            }
            clock: Clock = "wall" if settings.get("threads") == 2 else "cpu"
            return self.task(
                case, mode, measured, ours | settings, baseline, clock=clock
            )

        def draw(
            quality: Quality = quality, threads: int = 1
        ) -> Callable[[], Measured]:
            return partial(self._draw, source, view, quantity, quality, threads)

        tasks = [
            task(
                peer,
                partial(self._peer.draw, source, view, quantity, step),
                None,
                series=series,
                reference=reference,
                step_voxels=step,
                bits_read_back=8,
                **peers_own,
            ),
            task(own, draw(), series="ART", step_voxels=step, cutoff=quality.cutoff),
            task(
                f"ART, no more error than {peer}",
                partial(self._equal, source, view, quantity, step),
                series="ART, equal error",
                cutoff=EQUAL_CUTOFF,
            ),
        ]
        if name == THREADED_QUALITY:
            cut = replace(quality, cutoff=PEER_CUTOFF, renormalise=True)
            tasks += [
                task(
                    f"ART {name}, rays cut where {PEER} cuts them",
                    draw(cut),
                    series="ART, the peer's cut",
                    step_voxels=step,
                    cutoff=PEER_CUTOFF,
                ),
                task(
                    f"ART {name}, integrated",
                    draw(Quality.named(name)),
                    series="ART, integrated",
                    step_voxels=step,
                    cutoff=quality.cutoff,
                ),
                task(
                    f"ART {name}, two threads",
                    draw(threads=2),
                    own,
                    series="ART, two threads",
                    step_voxels=step,
                    cutoff=quality.cutoff,
                    threads=2,
                ),
            ]
        return tasks

    def _draw(
        self,
        source: SubjectSource,
        view: str,
        quantity: str,
        quality: Quality,
        threads: int,
    ) -> Measured:
        subject = source.subject
        camera = subject.views[view].camera(self._size, Projection.PERSPECTIVE)
        scene = subject.in_mode(quantity)
        tracer = ActiveRayTracer(scene, quality, threads=threads)
        timing, image = measure(lambda: tracer.render(camera), budget_s=self._budget_s)
        reference = source.references.picture(view, quantity, lambda: scene, camera)
        assert tracer.report is not None
        counters = {key: float(n) for key, n in tracer.report.counters.items()}
        picture = rgb_over_black(image.rgba)
        error = image_error(picture, reference)
        further = self._from_peer(source, view, quantity, picture)
        return Measured(timing, error, "linear", counters, further)

    def _from_peer(
        self,
        source: SubjectSource,
        view: str,
        quantity: str,
        picture: NDArray[np.float32],
    ) -> dict[str, float]:
        """Return how far a picture is from the peer's finest; nothing without it."""
        try:
            finest = self._peer.finest(source, view, quantity)
        except UnavailableError:
            return {}
        return {f"against {PEER_REFERENCE_NAME}": image_error(picture, finest).rmse}

    def _equal(
        self, source: SubjectSource, view: str, quantity: str, step: float
    ) -> Measured:
        """Draw with the coarsest step that errs no more than the peer's picture.

        Under lights each is judged by its own finest picture: the peer's shading is
        another.
        """
        subject = source.subject
        camera = subject.views[view].camera(self._size, Projection.PERSPECTIVE)
        scene = subject.in_mode(quantity)
        reference = source.references.picture(view, quantity, lambda: scene, camera)
        allowed = self._peer.error(source, view, quantity, step)
        for own_step in EQUAL_STEPS:
            quality = Quality(own_step, EQUAL_CUTOFF, renormalise=True, compact=True)
            tracer = ActiveRayTracer(scene, quality, threads=1)
            picture = rgb_over_black(tracer.render(camera).rgba)
            error = image_error(picture, reference)
            if error.rmse <= allowed:
                break
        else:
            raise UnavailableError(
                f"no step tried errs less than the peer's {allowed:.1e}: the finest by "
                f"{error.rmse:.1e}"
            )
        timing, _ = measure(lambda: tracer.render(camera), budget_s=self._budget_s)
        told = OF_PEER_ALONE if quantity == "shaded" else OF_PEER
        further = {told: allowed, **self._from_peer(source, view, quantity, picture)}
        return Measured(timing, error, "linear", {"own_step": own_step}, further)

    def _surface(
        self, source: SubjectSource, view: str, name: str, threads: int = 1
    ) -> Task:
        quality = Quality.named(name)
        alone = f"ART {name}, step {quality.step_voxels:g}"

        def own() -> Measured:
            subject = source.subject
            camera = subject.views[view].camera(
                self._surface_size, Projection.EQUIDISTANT
            )
            tracer = ActiveRayTracer(subject.scene, quality, threads=threads)
            timing, found = measure(
                lambda: tracer.gbuffer(camera), budget_s=self._budget_s
            )
            reference = source.references.gbuffer(view, lambda: subject.scene, camera)
            return Measured(
                timing,
                depth_error(found, reference),
                "mm",
                surface_counters(found, reference)
                | {"frames_per_second": 1 / timing.min_s},
            )

        return self.task(
            f"{source.name}/{view}/surface",
            alone if threads == 1 else f"ART {name}, two threads",
            own,
            {
                "size": self._surface_size,
                "step_voxels": quality.step_voxels,
                "threads": threads,
                "lens": "equidistant",
                "series": "ART" if threads == 1 else "ART, two threads",
                "reference": SURFACE_NAME,
            },
            baseline=None if threads == 1 else alone,
            clock="cpu" if threads == 1 else "wall",
        )
