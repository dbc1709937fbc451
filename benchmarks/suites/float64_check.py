"""The ray tracer beside the float64 ray caster: the same samples, so only rounding."""

from collections.abc import Callable
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from benchmarks.plan import Measured, Task
from benchmarks.scenes import SubjectSource
from benchmarks.schema import Setting
from benchmarks.timing import measure
from renderers.art import ActiveRayTracer, Quality
from renderers.reference import render_reference
from renderers.scene import Projection, image_error
from renderers.scene.deflection import Deflection

CHECK_SIZE = 24
CHECK_STEP = 1 / 8
"""The float64 reference takes the same samples: what differs is rounding."""

Bends: TypeAlias = Callable[[SubjectSource], Deflection]


def float64_check(
    suite: str, source: SubjectSource, bends: Bends | None = None
) -> list[Task]:
    """Compare rays with the independent float64 ray caster, on a small picture.

    bends: gives what bends the rays; they are straight without.
    """
    rays = "bent rays, " if bends else ""
    case = f"{source.name}/inside/{rays}float64 check"
    plain, art = "float64 ray caster", "ART, same samples"
    pictures: dict[str, NDArray[np.float64]] = {}
    settings: dict[str, Setting] = {
        "size": CHECK_SIZE,
        "step_voxels": CHECK_STEP,
        "threads": 1,
        "lens": "perspective",
    }

    def bent() -> Deflection | None:
        return bends(source) if bends else None

    def slow() -> Measured:
        subject = source.subject
        camera = subject.views["inside"].camera(CHECK_SIZE, Projection.PERSPECTIVE)
        step_mm = CHECK_STEP * float(subject.scene.volume.spacing_mm.min())
        timing, pictures[plain] = measure(
            lambda: render_reference(
                subject.scene,
                camera,
                step_mm,
                deflection=bent(),
            ),
            least=1,
            most=1,
            warm_up=False,
        )
        return Measured(timing)

    def fast() -> Measured:
        subject = source.subject
        camera = subject.views["inside"].camera(CHECK_SIZE, Projection.PERSPECTIVE)
        tracer = ActiveRayTracer(
            subject.scene,
            Quality(CHECK_STEP, 0.0),
            threads=1,
            deflection=bent(),
        )
        timing, image = measure(lambda: tracer.render(camera), budget_s=0.2)
        return Measured(timing, image_error(image.rgba, pictures[plain]), "linear RGBA")

    return [
        Task(suite, case, plain, slow, settings),
        Task(
            suite,
            case,
            art,
            fast,
            settings | {"reference": plain},
            baseline=plain,
        ),
    ]
