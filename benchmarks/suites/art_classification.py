"""Integrated transfer functions beside post-classified ones: time and error of both.

At equal steps, and at equal error: post-classified steps are halved until their error
is no larger than that of integrated ones.
"""

from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from benchmarks.plan import Measured, Plan, Task
from benchmarks.references import REFERENCE_QUALITY, rgb_over_black
from benchmarks.scenes import VIEWS, Subject, SubjectSource, subjects
from benchmarks.schema import Setting
from benchmarks.timing import measure
from renderers.art import ActiveRayTracer, Quality
from renderers.art.quality import ClassificationName
from renderers.scene import (
    Projection,
    Scene,
    TransferFunction,
    image_error,
    srgb_from_linear,
    ssim,
)

QUALITIES = ("preview", "snapshot", "final")
QUANTITIES = ("wall", "see-through", "thin shell")
REFERENCE_STEPS = {"wall": 1 / 32, "see-through": 1 / 32, "thin shell": 1 / 128}
"""In voxels: shorter than any of ours."""

FINEST_STEP = 1 / 64


def thin_shell() -> TransferFunction:
    """Show where tissue begins as a film: 60 HU wide, clear before and behind.

    A voxel at a wall passes some hundred HU.
    """
    return TransferFunction(
        np.array([-510.0, -480.0, -450.0]),
        np.array([[0.55, 0.2, 0.18], [0.9, 0.6, 0.5], [0.55, 0.2, 0.18]]),
        np.array([0.0, 8.0, 0.0]),
    )


class ClassificationPlan(Plan, suite="art-classification"):
    """List and make the measurements of suite `art-classification`."""

    def __init__(self, quick: bool) -> None:
        super().__init__(quick)
        self._size = 192 if quick else 512
        self._budget_s = 0.3 if quick else 2.0
        self._subjects = subjects(quick)
        self._references: dict[tuple[str, str, str], NDArray[np.float32]] = {}
        self._errors: dict[tuple[str, str, str, str], float] = {}

    def tasks(self) -> list[Task]:
        """List the tasks, what is compared with before what compares."""
        return [
            task
            for source in self._subjects
            for view in VIEWS
            for quantity in QUANTITIES
            for name in QUALITIES
            for task in self._tasks(source, view, quantity, name)
        ]

    def _tasks(
        self, source: SubjectSource, view: str, quantity: str, name: str
    ) -> list[Task]:
        step = Quality.named(name).step_voxels
        task = partial(self.task, f"{source.name}/{view}/{quantity}")
        draw = partial(self._draw, source, view, quantity, name)
        settings = partial(self._settings, quantity, step)
        return [
            task(f"{name}, post", partial(draw, "post"), settings("post")),
            task(
                f"{name}, integrated",
                partial(draw, "integrated"),
                settings("integrated"),
                baseline=f"{name}, post",
            ),
            task(
                f"post, error of {name}, integrated",
                partial(self._match, source, view, quantity, name),
                settings("post, as fine as needed"),
                baseline=f"{name}, integrated",
            ),
        ]

    def _settings(self, quantity: str, step: float, kind: str) -> dict[str, Setting]:
        finest = round(1 / REFERENCE_STEPS[quantity])
        return {
            "size": self._size,
            "step_voxels": step,
            "threads": 1,
            "lens": "perspective",
            "series": kind,
            "reference": f"ART integrated, step 1/{finest} voxel, cut-off 1e-6",
        }

    def _draw(
        self,
        source: SubjectSource,
        view: str,
        quantity: str,
        name: str,
        kind: ClassificationName,
    ) -> Measured:
        quality = replace(Quality.named(name), classification=kind)
        found = self._measure(source, view, quantity, quality)
        assert found.error is not None
        if kind == "integrated":
            self._errors[source.name, view, quantity, name] = found.error.rmse
        return found

    def _match(
        self, source: SubjectSource, view: str, quantity: str, name: str
    ) -> Measured:
        """Halve the step until the error is that of integrated steps, or less.

        With the cut-off of `final`: a larger one alone may leave more.
        """
        key = source.name, view, quantity, name
        if key not in self._errors:
            self._draw(source, view, quantity, name, "integrated")
        cutoff = Quality.named("final").cutoff
        quality = replace(Quality.named(name), cutoff=cutoff, classification="post")
        while True:
            found = self._measure(source, view, quantity, quality)
            assert found.error is not None
            found.counters["rmse_of_integrated"] = self._errors[key]
            enough = found.error.rmse <= self._errors[key]
            if enough or quality.step_voxels <= FINEST_STEP:
                return found
            quality = replace(quality, step_voxels=quality.step_voxels / 2)

    def _measure(
        self, source: SubjectSource, view: str, quantity: str, quality: Quality
    ) -> Measured:
        subject = source.subject
        scene = scene_of(subject, quantity)
        camera = subject.views[view].camera(self._size, Projection.PERSPECTIVE)
        key = source.name, view, quantity
        if key not in self._references:
            finest = replace(
                REFERENCE_QUALITY,
                step_voxels=REFERENCE_STEPS[quantity],
                classification="integrated",
            )
            truth = ActiveRayTracer(scene, finest).render(camera)
            self._references[key] = rgb_over_black(truth.rgba)
        tracer = ActiveRayTracer(scene, quality, threads=1)
        timing, image = measure(partial(tracer.render, camera), budget_s=self._budget_s)
        assert tracer.report is not None
        counters = {name: float(n) for name, n in tracer.report.counters.items()}
        counters["step_voxels"] = tracer.report.step_voxels
        found, wanted = rgb_over_black(image.rgba), self._references[key]
        error = image_error(found, wanted)
        # of codes that are not rounded, which would cost more than is asked for
        codes = [255 * srgb_from_linear(one) for one in (found, wanted)]
        counters["ssim"] = ssim(*codes)
        return Measured(timing, error, "linear", counters)


def scene_of(subject: Subject, quantity: str) -> Scene:
    """Dress a head in one of `QUANTITIES`."""
    if quantity != "thin shell":
        return subject.in_mode(quantity)
    return replace(subject.in_mode("wall"), transfer_function=thin_shell())
