"""A process that traces the shells with code for the processor its environment names.

Prints a line of JSON: seconds and counters of pictures without and with lights.
"""

import hashlib
import sys
from functools import partial

import msgspec

from app.environment import prepare_environment
from benchmarks.timing import measure


class Traced(msgspec.Struct):
    """Hold one picture: CPU seconds, counters, ns of a sample's reads, its hash."""

    min_s: float
    median_s: float
    cpu_s: float
    repeats: int
    samples: int
    contributing: int
    parts_ns: float
    digest: str


def trace_shells(size: int, pixels: int, budget_s: float) -> list[Traced]:
    """Draw the shells of suite `art-growth`, step 1/2, without and with lights."""
    prepare_environment()
    # After the environment is set: these import numba.
    from benchmarks.sample_parts import sample_parts_ns
    from benchmarks.suite_art_growth import shell_camera, shell_scene, shells
    from renderers.art import ActiveRayTracer

    volume, found = shells(size), []
    for lit, parts_ns in zip((False, True), sample_parts_ns(), strict=True):
        scene = shell_scene(volume, 1.0, lit=lit)
        tracer = ActiveRayTracer(scene, "snapshot", threads=1)
        camera = shell_camera(pixels)
        timing, image = measure(partial(tracer.render, camera), budget_s=budget_s)
        assert tracer.report is not None
        found.append(
            Traced(
                timing.min_s,
                timing.median_s,
                timing.cpu_s,
                timing.repeats,
                tracer.report.counters["samples"],
                tracer.report.counters["contributing"],
                parts_ns,
                hashlib.sha256(image.rgba.tobytes()).hexdigest(),
            )
        )
    return found


if __name__ == "__main__":
    size, pixels = int(sys.argv[1]), int(sys.argv[2])
    made = trace_shells(size, pixels, float(sys.argv[3]))
    sys.stdout.buffer.write(msgspec.json.encode(made))
