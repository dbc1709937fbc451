"""A process that traces the shells with code for the processor its environment names.

Prints a line of JSON: seconds and counters of a picture.
"""

import hashlib
import sys
from dataclasses import replace

import msgspec

from benchmarks.timing import measure
from paravol.environment import prepare_environment


class Traced(msgspec.Struct):
    """Hold one picture: CPU seconds, counters, its hash."""

    min_s: float
    median_s: float
    cpu_s: float
    repeats: int
    samples: int
    contributing: int
    digest: str


def trace_shells(size: int, pixels: int, budget_s: float, *, lit: bool) -> Traced:
    """Draw the shells of suite `art-growth`, step 1/2, without lights or with four."""
    prepare_environment()
    # After the environment is set: these import numba.
    from benchmarks.suites.art_growth import shell_camera, shell_scene, shells
    from renderers.art import ActiveRayTracer, Quality

    scene, camera = shell_scene(shells(size), 1.0, lit=lit), shell_camera(pixels)
    quality = replace(Quality.named("snapshot"), classification="post")
    tracer = ActiveRayTracer(scene, quality, threads=1)
    timing, image = measure(lambda: tracer.render(camera), budget_s=budget_s)
    assert tracer.report is not None
    return Traced(
        timing.min_s,
        timing.median_s,
        timing.cpu_s,
        timing.repeats,
        tracer.report.counters["samples"],
        tracer.report.counters["contributing"],
        hashlib.sha256(image.rgba.tobytes()).hexdigest(),
    )


if __name__ == "__main__":
    size, pixels, budget, lit = sys.argv[1:]
    made = trace_shells(int(size), int(pixels), float(budget), lit=bool(int(lit)))
    sys.stdout.buffer.write(msgspec.json.encode(made))
