"""The ray tracer's code against its limits, for this processor and for a lesser one.

Also what a live view asks of it: a head of 256 voxels from inside.
"""

import os
import subprocess
import sys
from dataclasses import dataclass
from functools import partial

import msgspec

from benchmarks.machine import ROOT
from benchmarks.plan import Measured, Plan, Task, UnavailableError
from benchmarks.references import SURFACE_NAME, depth_error, surface_counters
from benchmarks.scenes import SubjectSource, phantom_subject
from benchmarks.suites.art import SAMPLE_LIMIT_NS
from benchmarks.suites.art_on_target import Traced
from benchmarks.timing import Timing, measure
from renderers.art import ActiveRayTracer, Quality
from renderers.scene import Projection

TARGETS: dict[str, dict[str, str]] = {
    "code for this processor": {},
    "code for AVX2": {"NUMBA_CPU_NAME": "haswell", "NUMBA_CPU_FEATURES": "+avx2"},
}
"""What numba is told to compile for. With the name alone it would keep this processor's
features."""

LIGHTS = ("no lights", "four lights")

LIVE_SPACING_MM = 0.4022
LIVE_SIZE = 512
"""Makes the default head 256 voxels long."""


@dataclass(slots=True)
class _Sizes:
    voxels: int
    pixels: int
    budget_s: float
    spacing_mm: float


class KernelPlan(Plan, suite="art-kernels"):
    """List and make the measurements of suite `art-kernels`."""

    def __init__(self, quick: bool) -> None:
        self._sizes = (
            _Sizes(64, 128, 0.3, 5 * LIVE_SPACING_MM)
            if quick
            else _Sizes(128, 256, 2.0, LIVE_SPACING_MM)
        )
        self._made: dict[tuple[str, int], Traced] = {}
        self._head = SubjectSource(
            "head of 256", lambda: phantom_subject(self._sizes.spacing_mm)
        )

    def tasks(self) -> list[Task]:
        """List the tasks, this processor's first."""
        first = next(iter(TARGETS))
        found = [
            self.task(
                f"shells/{lights}/instructions",
                target,
                partial(self._trace, target, lit),
                {
                    "voxels": self._sizes.voxels,
                    "size": self._sizes.pixels,
                    "step_voxels": Quality.named("snapshot").step_voxels,
                    "threads": 1,
                },
                baseline=None if target == first else first,
                cost_s=60.0,
            )
            for lit, lights in enumerate(LIGHTS)
            for target in TARGETS
        ]
        return found + [self._live(threads) for threads in (1, 2)]

    def _trace(self, target: str, lit: int) -> Measured:
        made = self._made[target, lit] = self._run(target, lit)
        first = self._made.get((next(iter(TARGETS)), lit))
        if first is not None and first.digest != made.digest:
            raise UnavailableError(f"{target} drew other bits than the first did")
        ns = 1e9 * made.cpu_s
        return Measured(
            Timing(made.min_s, made.median_s, made.cpu_s, made.repeats),
            counters={
                "samples": made.samples,
                "contributing": made.contributing,
                "ns_per_contributing": ns / made.contributing,
                "limit_ns_per_contributing": SAMPLE_LIMIT_NS,
                "share_of_limit": SAMPLE_LIMIT_NS * made.contributing / ns,
            },
        )

    def _run(self, target: str, lit: int) -> Traced:
        sizes = self._sizes
        size, pixels, budget = sizes.voxels, sizes.pixels, sizes.budget_s
        done = subprocess.run(
            [
                sys.executable,
                "-m",
                "benchmarks.suites.art_on_target",
                *map(str, (size, pixels, budget, lit)),
            ],
            cwd=ROOT,
            env=os.environ | TARGETS[target],
            capture_output=True,
            timeout=600,
            check=False,
        )
        if done.returncode:
            said = done.stderr.decode(errors="replace").strip().splitlines()
            raise UnavailableError(f"{target} could not be run: {said[-1:]}")
        return msgspec.json.decode(done.stdout, type=Traced)

    def _live(self, threads: int) -> Task:
        alone = "ART preview"

        def look() -> Measured:
            subject = self._head.subject
            camera = subject.views["inside"].camera(LIVE_SIZE, Projection.EQUIDISTANT)
            tracer = ActiveRayTracer(subject.scene, "preview", threads=threads)
            timing, found = measure(
                lambda: tracer.gbuffer(camera), budget_s=self._sizes.budget_s
            )
            reference = self._head.references.gbuffer(
                "inside", lambda: subject.scene, camera
            )
            counters = surface_counters(found, reference) | {
                "frames_per_second": 1 / timing.min_s,
                "voxels_along_the_longest_side": max(subject.scene.volume.shape),
            }
            return Measured(timing, depth_error(found, reference), "mm", counters)

        return self.task(
            f"{self._head.name}/inside/surface",
            alone if threads == 1 else f"{alone}, two threads",
            look,
            {
                "size": LIVE_SIZE,
                "spacing_mm": self._sizes.spacing_mm,
                "threads": threads,
                "lens": "equidistant",
                "reference": SURFACE_NAME,
            },
            baseline=None if threads == 1 else alone,
            clock="cpu" if threads == 1 else "wall",
        )
