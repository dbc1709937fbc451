"""Light from wall to wall by us and by Mitsuba, in noses of one colour."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from benchmarks.gallery.gallery_views import gallery_scene
from benchmarks.gallery.panel import Absent, Family, Panel, encoded, likeness
from benchmarks.gallery.scope_studio import surface_of
from benchmarks.light_witness import BOUNCES, DiffuseRoom, Estimate, LightDifference
from benchmarks.nasal_views import NasalView
from benchmarks.peers.light_jobs import LightJobs, mitsuba_process
from benchmarks.plan import UnavailableError
from renderers.shading.kernels.path_tracing import LIFTED_MM

SIDE_SHARE = 1 / 4
"""Of the gallery's pictures: paths are slow."""
PASSES = 8
PATHS = 16
RIGHT_MEAN, RIGHT_ERROR = 0.02, 0.01
"""Mitsuba's mean light must be within the first of ours, and its standard error below
the second, for its time to count. Its own way of leaving rough walls parts the two by
more than noise (docs/light.md)."""

MITSUBA = "Mitsuba, to our noise"
LIFTED = "Mitsuba, off walls as ours"
REFERENCE = "reference"
FAMILY = Family(
    "witness",
    "Light from wall to wall, and its witness",
    (MITSUBA, LIFTED, REFERENCE),
    f"our path tracer with {PASSES * PATHS} paths a pixel",
    "relative difference of the mean light",
    "Walls of one pale colour, light that came by way of other walls only, a pinhole, "
    f"{SIDE_SHARE:g} of the other pictures' side. Mitsuba's time is scaled to our "
    "noise: time goes with one over its square. SSIM is of two noisy pictures. A path "
    "of its own that leaves a rough wall below the wall's triangle ends there. Off "
    "walls as ours it begins a little above, meets the wall and goes on, and none is "
    "ended by chance.",
)


class WitnessStudio:
    """Draw the family `FAMILY`."""

    family = FAMILY

    def __init__(self) -> None:
        self._peer = mitsuba_process()
        self._jobs: LightJobs | None = None
        self._head = ""

    def draw(self, view: NasalView) -> list[Panel | Absent]:
        """Follow light both ways, each on one thread."""
        side = max(16, round(SIDE_SHARE * view.camera.width))
        small = replace(view, camera=view.camera.with_size(side, side))
        room = DiffuseRoom(small, surface_of(gallery_scene(view.head)))
        own, timing = room.bounced(PASSES)
        exposure = max(float(np.quantile(own.mean, 0.98)), 1e-12)
        ours = encoded(own.mean / exposure)
        reference = Panel(REFERENCE, ours, timing.cpu_s, 0.0, 1.0)
        panels: list[Panel | Absent] = []
        for who, lifted_mm in ((MITSUBA, None), (LIFTED, LIFTED_MM)):
            try:
                passes, cpu_s = self._ask(room, view.head, lifted_mm)
            except UnavailableError as error:
                panels.append(Absent(who, str(error)))
                continue
            theirs = Estimate.of_passes(passes)
            found = LightDifference.of(own, theirs)
            pixels = encoded(theirs.mean / exposure)
            scaled: float | None = cpu_s * (theirs.noise / own.noise) ** 2
            why = ""
            if abs(found.mean) > RIGHT_MEAN or found.mean_error > RIGHT_ERROR:
                scaled = None
                why = (
                    f"its mean light is {100 * found.mean:+.2f} % from ours, with "
                    f"{100 * found.mean_error:.2f} % of error"
                )
            alike = likeness(pixels, ours)
            panels.append(Panel(who, pixels, scaled, abs(found.mean), alike, why))
        return [*panels, reference]

    def close(self) -> None:
        """End the peer."""
        self._peer.close()

    def _ask(
        self, room: DiffuseRoom, head: str, lifted_mm: float | None
    ) -> tuple[NDArray[np.float32], float]:
        if self._jobs is None or head != self._head:
            self._jobs = LightJobs(self._peer, room.surface.distance, room.albedo)
            self._head = head
        job = self._jobs.job(
            room.camera,
            room.light,
            paths=PATHS,
            passes=PASSES,
            bounces=BOUNCES,
            refined=2,
            lifted_mm=lifted_mm,
        )
        return self._jobs.passes(job)
