"""What each ingredient of the look costs, and what a picture lacks without it."""

from dataclasses import dataclass, fields, replace
from functools import cache, partial

import numpy as np

from benchmarks.nasal_views import NasalView, acceptance_views, nasal_scene
from benchmarks.plan import Measured, Plan, Task
from benchmarks.timing import Timing, measure
from renderers.art import ActiveRayTracer
from renderers.scene import GBuffer, Material, image_error
from renderers.shading import (
    CameraPass,
    CameraSettings,
    Caster,
    Effects,
    ScopeShader,
    Tier,
)
from renderers.shading.half_light import HALF_FROM_PX
from scenarios import tip_frame

EVERYTHING = "everything"

TOOL_AT_MM = (-1.5, -2.2, 15.0)
TOOL_ALONG = (0.05, 0.12, 1.0)
"""Tip of the suction tube and where it points, in the camera's axes right, up,
forward: some millimetres before the wall of the nasopharynx."""

SHOWN = "vestibule", "turbinate", "choana"

NAMES = {
    "tool_shadow": "shadow of the tool",
    "hairs": "hairs",
    "metal_mirror": "walls in metal",
    "film_mirror": "walls in the film",
    "thin_walls": "light through thin walls",
}


@dataclass(frozen=True, slots=True)
class Shown:
    """One view's geometry, and the tool in it."""

    view: NasalView
    gbuffer: GBuffer
    casters: tuple[Caster, ...]


@cache
def shown_views(size: int) -> list[Shown]:
    """Return the views, with a tool in one of them."""
    # Imported here: building meshes loads a large library.
    from scenarios.instruments import suction_tube

    tracer = ActiveRayTracer(nasal_scene("default"))
    tube = suction_tube()
    found = []
    for view in acceptance_views(size):
        if view.name not in SHOWN:
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


class LookPlan(Plan, suite="look"):
    """List and make the measurements of suite `look`."""

    def __init__(self, quick: bool) -> None:
        super().__init__(quick)
        self._size = 128 if quick else 512
        self._budget_s = 0.2 if quick else 1.5

    def tasks(self) -> list[Task]:
        """List the tasks, baselines first."""
        found = []
        for tier in (Tier.LIVE, Tier.FULL):
            runs = {EVERYTHING: partial(self._shaded, tier, tier.effects)}
            for field in fields(Effects):
                if getattr(tier.effects, field.name):
                    less = replace(tier.effects, **{field.name: False})
                    name = f"without {NAMES[field.name]}"
                    runs[name] = partial(self._shaded, tier, less)
            found += self.compared(
                f"nose/views/{tier.name.lower()} shading",
                runs,
                {
                    "size": self._size,
                    "tier": tier.name,
                    "threads": 1,
                    "views": len(SHOWN),
                    "reference": EVERYTHING,
                },
                cost_s=30.0,
                series=True,
            )
        both = {
            tier.name: partial(self._shaded, tier, tier.effects, HALF_FROM_PX)
            for tier in (Tier.LIVE, Tier.FLIGHT)
        }
        found += self.compared(
            "nose/views/half light",
            both,
            {"size": HALF_FROM_PX, "threads": 1, "reference": Tier.LIVE.name},
            cost_s=30.0,
            series=True,
        )
        return found

    def _shaded(
        self, tier: Tier, effects: Effects, size: int | None = None
    ) -> Measured:
        """Shade all views; say how the pictures differ from those of everything."""
        surface = nasal_scene("default").surface
        assert surface is not None
        shader = ScopeShader(surface, tier, threads=1, effects=effects)
        right_tier = Tier.LIVE if tier is Tier.FLIGHT else tier
        whole = ScopeShader(surface, right_tier, threads=1)
        finish = CameraPass(CameraSettings(noise=0), threads=1)
        timings, found, wanted = [], [], []
        counters: dict[str, float] = {}
        views = shown_views(size or self._size)
        for shown in views:
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
            sum((s.gbuffer.material == Material.METAL).sum() for s in views)
        )
        for made in (shader, whole, finish):
            made.close()
        error = image_error(np.stack(found), np.stack(wanted))
        return Measured(Timing.sum(timings), error, "sRGB", counters)
