"""What each ingredient of the look costs, and what a picture lacks without it."""

from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from benchmarks.nasal_views import NasalView, acceptance_views, nasal_scene, path_views
from benchmarks.plan import Measured, Plan, Task
from benchmarks.schema import Setting
from benchmarks.timing import Timing, measure
from renderers.art import ActiveRayTracer
from renderers.fsr.surfels import SurfelRasterizer
from renderers.scene import GBuffer, Material, image_error
from renderers.scene.thread_team import ThreadTeam
from renderers.shading import (
    CameraPass,
    CameraSettings,
    Caster,
    Effects,
    ScopeShader,
    Tier,
)
from scenarios import tip_frame

EVERYTHING = "everything"
SHARP, RAGGED = "rims by rays", "rims by discs"

TOOL_AT_MM = (-1.5, -2.2, 15.0)
TOOL_ALONG = (0.05, 0.12, 1.0)
"""Tip of the suction tube and where it points, in the camera's axes right, up,
forward: some millimetres before the wall of the nasopharynx."""

NAMES = {
    "tool_shadow": "shadow of the tool",
    "hairs": "hairs",
    "metal_mirror": "walls in metal",
    "film_mirror": "walls in the film",
    "thin_walls": "light through thin walls",
}


@dataclass(frozen=True, slots=True)
class Shown:
    """Hold one view's geometry, and the tool in it."""

    view: NasalView
    gbuffer: GBuffer
    casters: tuple[Caster, ...]


class LookPlan(Plan, suite="look"):
    """List and make the measurements of suite `look`."""

    def __init__(self, quick: bool) -> None:
        self._size = 128 if quick else 512
        self._budget_s = 0.2 if quick else 1.5
        self._team = ThreadTeam(1)

    def tasks(self) -> list[Task]:
        """List the tasks, baselines first."""
        found = []
        for tier in (Tier.LIVE, Tier.FULL):
            settings: dict[str, Setting] = {
                "size": self._size,
                "tier": tier.name,
                "threads": 1,
                "views": len(self._shown_names),
            }
            case = f"nose/views/{tier.name.lower()} shading"
            runs: dict[str, Callable[[], Measured]] = {
                EVERYTHING: partial(self._shaded, tier, tier.effects)
            }
            for field in fields(Effects):
                if getattr(tier.effects, field.name):
                    less = replace(tier.effects, **{field.name: False})
                    name = f"without {NAMES[field.name]}"
                    runs[name] = partial(self._shaded, tier, less)
            for name, run in runs.items():
                found.append(
                    self.task(
                        case,
                        name,
                        run,
                        settings | {"series": name, "reference": EVERYTHING},
                        baseline=None if name == EVERYTHING else EVERYTHING,
                        cost_s=30.0,
                    )
                )
        settings = {"size": self._size, "threads": 1, "reference": "ray tracer"}
        found += [
            self.task(
                "nose/views/rims",
                name,
                partial(self._rims, name),
                settings | {"series": name},
                baseline=None if name == RAGGED else RAGGED,
                cost_s=30.0,
            )
            for name in (RAGGED, SHARP)
        ]
        return found

    def close(self) -> None:
        """End the threads."""
        self._team.close()

    _shown_names = ("vestibule", "turbinate", "choana")

    @cached_property
    def _shown(self) -> list[Shown]:
        # Imported here: building meshes loads a large library.
        from scenarios.instruments import suction_tube

        tracer = ActiveRayTracer(nasal_scene("default"))
        tube = suction_tube()
        found = []
        for view in acceptance_views(self._size):
            if view.name not in self._shown_names:
                continue
            buffer = tracer.gbuffer(view.camera)
            casters: tuple[Caster, ...] = ()
            if view.name == "choana":
                eye, *axes = view.camera.frame
                tip = eye + np.array(TOOL_AT_MM) @ np.array(axes)
                pose = tip_frame(tip, np.array(TOOL_ALONG) @ np.array(axes))
                tube.draw(buffer, view.camera, pose)
                casters = (Caster.of(tube, pose),)
            found.append(Shown(view, buffer, casters))
        return found

    @cached_property
    def _pictures(self) -> dict[Tier, NDArray[np.float32]]:
        return {}

    def _shaded(self, tier: Tier, effects: Effects) -> Measured:
        """Shade all views; say how the pictures differ from those of everything."""
        surface = nasal_scene("default").surface
        assert surface is not None
        shader = ScopeShader(surface, tier, threads=1, effects=effects)
        whole = ScopeShader(surface, tier, threads=1)
        finish = CameraPass(CameraSettings(noise=0), threads=1)
        timings, found, wanted = [], [], []
        counters: dict[str, float] = {}
        for shown in self._shown:
            camera, light = shown.view.camera, shown.view.light
            shade = partial(
                shader.shade, shown.gbuffer, camera, light, casters=shown.casters
            )
            timing, radiance = measure(shade, budget_s=self._budget_s)
            timings.append(timing)
            right = whole.shade(shown.gbuffer, camera, light, casters=shown.casters)
            reference, gain = finish.finish(right, shown.gbuffer, camera)
            pixels, _ = finish.finish(radiance, shown.gbuffer, camera, gain=gain)
            found.append(pixels.astype(np.float32) / np.float32(255))
            wanted.append(reference.astype(np.float32) / np.float32(255))
            off = 255 * image_error(found[-1], wanted[-1]).rmse
            counters[f"codes, {shown.view.name}"] = off
            counters[f"ms, {shown.view.name}"] = 1e3 * timing.min_s
        counters["metal pixels"] = float(
            sum((s.gbuffer.material == Material.METAL).sum() for s in self._shown)
        )
        for made in (shader, whole, finish):
            made.close()
        error = image_error(np.stack(found), np.stack(wanted))
        return Measured(_sum(timings), error, "sRGB", counters)

    def _rims(self, mode: str) -> Measured:
        """Draw views by splats; count pixels that show another wall than rays do."""
        scene = nasal_scene("default")
        assert scene.surface is not None
        rasterizer = SurfelRasterizer(scene.surface.distance, sharp=mode != RAGGED)
        tracer = ActiveRayTracer(scene)
        timings = []
        wrong = pixels = 0
        for view in path_views(self._size, 4):
            draw = partial(rasterizer.draw, view.camera, self._team)
            timing, found = measure(draw, budget_s=self._budget_s)
            timings.append(timing)
            truth = tracer.gbuffer(view.camera)
            both = (truth.coverage > 0) & (found.coverage > 0)
            apart = np.abs(found.depth_mm[both] - truth.depth_mm[both])
            wrong += int(np.count_nonzero(apart > 0.5))
            pixels += int(both.sum())
        counters = {
            "pixels of another wall, share": wrong / pixels,
            "ms a view": 1e3 * sum(t.min_s for t in timings) / len(timings),
        }
        return Measured(_sum(timings), counters=counters)


def _sum(timings: list[Timing]) -> Timing:
    """Add the times of several views."""
    return Timing(
        sum(t.min_s for t in timings),
        sum(t.median_s for t in timings),
        sum(t.cpu_s for t in timings),
        min(t.repeats for t in timings),
    )
