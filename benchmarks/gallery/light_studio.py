"""What each light does to the same walls, beside light that is followed by paths."""

from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from benchmarks.gallery.gallery_views import gallery_scene
from benchmarks.gallery.panel import Absent, Family, Panel, likeness
from benchmarks.gallery.scope_studio import BUDGET_S, surface_of
from benchmarks.nasal_views import NasalView
from benchmarks.timing import measure, once
from renderers.art import ActiveRayTracer
from renderers.scene import AirSurface, GBuffer, image_error
from renderers.shading import (
    CameraPass,
    CameraSettings,
    Effects,
    ScopeLight,
    ScopeShader,
    Tier,
)
from renderers.shading.path_tracer import PathLight, PathTracer

BATCHES = 2
REFERENCE_BATCHES = 4
"""Of 16 paths a pixel: for the picture that is judged, and for the one that judges."""
OWN_SEED, REFERENCE_SEED = 1, 2

HEADLIGHT, RING = "headlight, no bounce", "ring, no bounce"
QUICK = "ring, virtual lights"
MIRRORED = "and mirrored in the film"
THIN = "and through thin walls"
PATHS = f"path-traced, {16 * BATCHES} paths"
REFERENCE = "reference"
FAMILY = Family(
    "light",
    "Each light on the same walls",
    (HEADLIGHT, RING, QUICK, MIRRORED, THIN, PATHS, REFERENCE),
    f"light path-traced with {16 * REFERENCE_BATCHES} paths a pixel, all effects; its "
    "own noise is in every error",
    "rms of linear radiance over its mean",
    "Tier FULL on the walls that rays find, one gain a view. The headlight has all "
    "fibre ends in the lens; the ring has them around it, as a scope. Time is of the "
    "light alone; paths are followed on two threads, whose CPU times are added.",
)
PLAIN = Effects(tool_shadow=False, metal_mirror=False)
"""Hairs stand in every picture."""


class LightStudio:
    """Draw the family `FAMILY`."""

    family = FAMILY

    def __init__(self) -> None:
        self._camera_pass = CameraPass(CameraSettings(noise=0), threads=1)

    def draw(self, view: NasalView) -> list[Panel | Absent]:
        """Light the view in all ways."""
        scene = gallery_scene(view.head)
        surface = surface_of(scene)
        walls = ActiveRayTracer(scene, threads=2).gbuffer(view.camera)
        nothing = np.zeros((*walls.size, 3), np.float32)
        dark = PathLight(nothing, nothing, 0)
        headlight = replace(view.light, ring_radius_mm=0.0)
        mirrored = replace(PLAIN, film_mirror=True)
        every = replace(mirrored, thin_walls=True)
        judge, long = self._paths(
            view, surface, walls, REFERENCE_SEED, REFERENCE_BATCHES
        )
        own, spent = self._paths(view, surface, walls, OWN_SEED, BATCHES)
        ways: dict[str, tuple[ScopeLight, Effects, PathLight | None, float]] = {
            HEADLIGHT: (headlight, PLAIN, dark, 0.0),
            RING: (view.light, PLAIN, dark, 0.0),
            QUICK: (view.light, PLAIN, None, 0.0),
            MIRRORED: (view.light, mirrored, None, 0.0),
            THIN: (view.light, every, None, 0.0),
            PATHS: (view.light, every, own, spent),
            REFERENCE: (view.light, every, judge, long),
        }
        made: dict[str, tuple[NDArray[np.float32], float]] = {}
        for who, (light, effects, bounce, before) in ways.items():
            shader = ScopeShader(surface, Tier.FULL, threads=1, effects=effects)
            timing, radiance = measure(
                partial(shader.shade, walls, view.camera, light, bounce),
                budget_s=BUDGET_S,
                least=2,
            )
            shader.close()
            made[who] = radiance, before + timing.cpu_s
        truth, _ = made[REFERENCE]
        unit = max(float(truth.mean()), 1e-12)
        shown, gain = self._camera_pass.finish(truth, walls, view.camera)
        panels: list[Panel | Absent] = []
        for who, (radiance, cpu_s) in made.items():
            pixels, _ = self._camera_pass.finish(
                radiance, walls, view.camera, gain=gain
            )
            off = image_error(radiance, truth).rmse / unit
            panels.append(Panel(who, pixels, cpu_s, off, likeness(pixels, shown)))
        return panels

    def close(self) -> None:
        """End the threads."""
        self._camera_pass.close()

    def _paths(
        self,
        view: NasalView,
        surface: AirSurface,
        walls: GBuffer,
        seed: int,
        batches: int,
    ) -> tuple[PathLight, float]:
        """Follow paths; give the light and the CPU seconds."""
        tracer = PathTracer(surface, seed=seed, threads=2)
        timing, found = once(
            lambda: tracer.light(walls, view.camera, view.light, batches=batches)
        )
        tracer.close()
        return found, timing.cpu_s
