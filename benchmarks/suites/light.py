"""The quick bounce light beside light that is followed from wall to wall."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from benchmarks.light_witness import BOUNCES, Agreement, DiffuseRoom, Estimate
from benchmarks.nasal_views import NasalView, acceptance_views, nasal_scene
from benchmarks.peers.light_jobs import LightJobs, mitsuba_process
from benchmarks.plan import Measured, Plan, Task, UnavailableError
from benchmarks.schema import Setting
from benchmarks.timing import Timing, measure
from renderers.art import ActiveRayTracer
from renderers.scene import AirSurface, GBuffer, image_error
from renderers.shading import ScopeShader, Tier
from renderers.shading.kernels.path_tracing import LIFTED_MM
from renderers.shading.path_tracer import PathLight, PathTracer

PATHS = "paths from wall to wall"
NOTHING = "no bounce light"
QUICK = "virtual lights"
WITNESSED = "path-traced light"
WITNESSES = {
    "Mitsuba's path-traced light": None,
    "Mitsuba's, off walls as ours": LIFTED_MM,
}
"""By name, how far above its wall a path goes on; None for its own way."""
WITNESS_PATHS = 64
"""Of a pixel in each of its independent passes."""


@dataclass(frozen=True, slots=True)
class Lit:
    """Hold a view's geometry and the light its walls send one another."""

    view: NasalView
    surface: AirSurface
    gbuffer: GBuffer
    light: PathLight


class LightPlan(Plan, suite="light"):
    """List and make the measurements of suite `light`."""

    def __init__(self, quick: bool) -> None:
        self._size = 48 if quick else 96
        self._batches = 4 if quick else 16
        views = acceptance_views(self._size)
        self._views = views[1:3] if quick else views
        self._peer = mitsuba_process()

    def close(self) -> None:
        """End the peer."""
        self._peer.close()

    def tasks(self) -> list[Task]:
        """List the tasks, baselines first."""
        case = "nose/views/bounce"
        settings: dict[str, Setting] = {
            "size": self._size,
            "threads": 2,
            "views": len(self._views),
            "reference": PATHS,
        }
        found = [
            self.task(
                case,
                PATHS,
                self._paths,
                settings | {"series": PATHS, "batches": self._batches},
                clock="wall",
                cost_s=60.0,
            )
        ]
        runs: dict[str, Callable[[], Measured]] = {
            NOTHING: partial(self._shaded, Tier.FULL, dark=True)
        }
        for tier in Tier:
            runs[f"{tier.virtual_lights} {QUICK}"] = partial(self._shaded, tier)
        found += [
            self.task(
                case,
                name,
                run,
                settings | {"series": name},
                baseline=PATHS,
                clock="wall",
                cost_s=10.0,
            )
            for name, run in runs.items()
        ]
        case = "nose/turbinate/bounce"
        settings = {"size": self._size, "threads": 1, "bounces": BOUNCES}
        found += [
            self.task(case, WITNESSED, self._own_paths, settings, cost_s=60.0),
            *(
                self.task(
                    case,
                    name,
                    partial(self._their_paths, lifted_mm),
                    settings | {"paths": WITNESS_PATHS},
                    baseline=WITNESSED,
                    cost_s=90.0,
                )
                for name, lifted_mm in WITNESSES.items()
            ),
        ]
        return found

    @cached_property
    def _room(self) -> DiffuseRoom:
        return DiffuseRoom.at("turbinate", self._size)

    @cached_property
    def _own(self) -> tuple[Estimate, Timing]:
        return self._room.bounced(self._batches)

    def _own_paths(self) -> Measured:
        own, timing = self._own
        return Measured(timing, counters={"noise a pixel": own.noise})

    def _their_paths(self, lifted_mm: float | None) -> Measured:
        """Measure Mitsuba to our noise; UnavailableError where its light differs.

        Time goes with one over the square of the noise, which independent passes
        tell.
        """
        own, _ = self._own
        room = self._room
        jobs = LightJobs(self._peer, room.surface.distance, room.albedo)
        job = jobs.job(
            room.camera,
            room.light,
            paths=WITNESS_PATHS,
            passes=self._batches,
            bounces=BOUNCES,
            refined=2,
            lifted_mm=lifted_mm,
        )
        passes, cpu_s = jobs.passes(job)
        theirs = Estimate.of_passes(passes)
        found = Agreement.of(own, theirs, room.edges)
        if not found.is_same_light:
            raise UnavailableError(
                f"its light is {100 * found.mean:+.2f} % beside ours, "
                f"{100 * found.mean_error:.2f} % of error: not the same picture, so "
                "its time does not count"
            )
        scale = (theirs.noise / own.noise) ** 2
        return Measured(
            Timing(cpu_s * scale, cpu_s * scale, cpu_s * scale, 1),
            counters={
                "noise a pixel as measured": theirs.noise,
                "cpu_s as measured": cpu_s,
                "mean difference": found.mean,
                "its error": found.mean_error,
            },
        )

    @cached_property
    def _lit(self) -> list[Lit]:
        found = []
        for view in self._views:
            scene = nasal_scene(view.head)
            assert scene.surface is not None
            gbuffer = ActiveRayTracer(scene, threads=2).gbuffer(view.camera)
            tracer = PathTracer(scene.surface)
            light = tracer.light(
                gbuffer, view.camera, view.light, batches=self._batches
            )
            tracer.close()
            found.append(Lit(view, scene.surface, gbuffer, light))
        return found

    def _paths(self) -> Measured:
        lit = self._lit[0]
        tracer = PathTracer(lit.surface)
        timing, _ = measure(
            lambda: tracer.light(
                lit.gbuffer, lit.view.camera, lit.view.light, batches=self._batches
            ),
            least=1,
            warm_up=False,
        )
        tracer.close()
        noise = [each.light.noise() for each in self._lit]
        return Measured(
            timing,
            counters={
                "paths a pixel": float(lit.light.paths),
                "noise, worst view": max(noise),
            },
        )

    def _shaded(self, tier: Tier, *, dark: bool = False) -> Measured:
        """Shade all views with the tier's own bounce light and with the true one."""
        found: list[NDArray[np.float32]] = []
        truth: list[NDArray[np.float32]] = []
        counters: dict[str, float] = {}
        timing = None
        for lit in self._lit:
            shader = ScopeShader(lit.surface, tier)
            camera, light = lit.view.camera, lit.view.light
            nothing = np.zeros_like(lit.light.irradiance)
            bounce = PathLight(nothing, nothing, 0) if dark else None
            shade = partial(shader.shade, lit.gbuffer, camera, light, bounce)
            if timing is None:
                timing, own = measure(shade)
            else:
                own = shade()
            right = shader.shade(lit.gbuffer, camera, light, lit.light)
            shader.close()
            seen = lit.gbuffer.coverage > 0
            unit = float(right[seen].mean())
            found.append(own[seen] / unit)
            truth.append(right[seen] / unit)
            error = image_error(found[-1], truth[-1])
            counters[f"rmse, {lit.view.name}"] = error.rmse
        assert timing is not None
        error = image_error(np.concatenate(found), np.concatenate(truth))
        return Measured(timing, error, "mean radiance", counters)
