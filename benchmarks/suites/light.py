"""The quick bounce light beside light that is followed from wall to wall."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from benchmarks.nasal_views import NasalView, acceptance_views, nasal_scene
from benchmarks.plan import Measured, Plan, Task
from benchmarks.schema import Setting
from benchmarks.timing import measure, once
from renderers.art import ActiveRayTracer
from renderers.scene import AirSurface, GBuffer, image_error
from renderers.shading import ScopeShader, Tier
from renderers.shading.path_tracer import PathLight, PathTracer

PATHS = "paths from wall to wall"
NOTHING = "no bounce light"
QUICK = "virtual lights"


@dataclass(frozen=True, slots=True)
class Lit:
    """A view's geometry and the light its walls send one another."""

    view: NasalView
    surface: AirSurface
    gbuffer: GBuffer
    light: PathLight


class LightPlan(Plan, suite="light"):
    """List and make the measurements of suite `light`."""

    def __init__(self, quick: bool) -> None:
        super().__init__(quick)
        self._size = 48 if quick else 96
        self._batches = 4 if quick else 16
        views = acceptance_views(self._size)
        self._views = views[1:3] if quick else views

    def tasks(self) -> list[Task]:
        """List the tasks, baselines first."""
        settings: dict[str, Setting] = {
            "size": self._size,
            "threads": 2,
            "views": len(self._views),
            "reference": PATHS,
        }
        runs: dict[str, Callable[[], Measured]] = {
            PATHS: self._paths,
            NOTHING: partial(self._shaded, Tier.FULL, dark=True),
        }
        for tier in Tier:
            runs[f"{tier.virtual_lights} {QUICK}"] = partial(self._shaded, tier)
        found = self.compared(
            "nose/views/bounce", runs, settings, clock="wall", cost_s=10.0, series=True
        )
        told = found[0].settings | {"batches": self._batches}
        return [replace(found[0], settings=told, cost_s=60.0), *found[1:]]

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
        timing, _ = once(
            lambda: tracer.light(
                lit.gbuffer, lit.view.camera, lit.view.light, batches=self._batches
            )
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
