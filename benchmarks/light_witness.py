"""Our light from wall to wall beside another program's, pixel by pixel."""

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from benchmarks.nasal_views import NasalView, acceptance_views, nasal_scene
from benchmarks.timing import Timing, once
from renderers.art import ActiveRayTracer
from renderers.scene import AirSurface, GBuffer, Projection
from renderers.shading.kernels.path_tracing import direct
from renderers.shading.lit_walls import fibre_light, seen_field
from renderers.shading.path_tracer import SOURCES, PathTracer, SeenWalls
from renderers.shading.tissue_colour import colour_table

BLOOD_CODE = 20
"""Pale mucosa, red albedo .57: a third of the red light comes by way of other walls."""
BOUNCES = 12
VIEWS = ("turbinate", "choana")


@dataclass(frozen=True, slots=True)
class Estimate:
    """A picture and its standard error, both ``(h, w, 3)``."""

    mean: NDArray[np.float64]
    error: NDArray[np.float64]

    @classmethod
    def of_passes(cls, passes: NDArray[np.float32]) -> "Estimate":
        """Take them from independent passes ``(n, h, w, 3)``."""
        spread = passes.std(axis=0, ddof=1, dtype=np.float64)
        return cls(
            passes.mean(axis=0, dtype=np.float64), spread / math.sqrt(len(passes))
        )

    @property
    def noise(self) -> float:
        """Return the root mean square error over the mean, as `PathLight.noise`."""
        return math.sqrt(float((self.error**2).mean())) / float(self.mean.mean())


@dataclass(frozen=True, slots=True)
class LightDifference:
    """How the mean of another estimate of the same light differs from ours.

    mean: relative difference over all pixels and colours. mean_error: its standard
    error.
    """

    mean: float
    mean_error: float

    @classmethod
    def of(cls, own: Estimate, theirs: Estimate) -> "LightDifference":
        """Compare two estimates."""
        unit = own.mean.mean()
        apart = theirs.mean - own.mean
        # a pixel's colours come by the same paths: their errors add up
        together = np.hypot(own.error, theirs.error).sum(axis=-1)
        error = np.sqrt((together**2).sum()) / apart.size
        return cls(float(apart.mean() / unit), float(error / unit))


class DiffuseRoom:
    """Let us see one place of the scope in a nose of one colour, by a pinhole."""

    def __init__(self, view: NasalView, surface: AirSurface) -> None:
        code = np.full(surface.blood.shape, BLOOD_CODE, np.uint8)
        self.surface = AirSurface(
            surface.distance,
            surface.blood.with_values(code, 0),
            surface.skin.with_values(np.zeros_like(code), 0),
        )
        self.name = view.name
        self.camera = replace(view.camera, projection=Projection.PERSPECTIVE)
        self.light = view.light

    @classmethod
    def at(cls, name: str, size: int) -> "DiffuseRoom":
        """Give one of the acceptance views, see `VIEWS`."""
        views = {view.name: view for view in acceptance_views(size)}
        view = views[name]
        surface = nasal_scene(view.head).surface
        assert surface is not None
        return cls(view, surface)

    @property
    def albedo(self) -> NDArray[np.float64]:
        """Return it for red, green, blue."""
        return colour_table()[BLOOD_CODE, :3].astype(np.float64)

    @cached_property
    def gbuffer(self) -> GBuffer:
        """Return what is seen."""
        scene = replace(nasal_scene("default"), surface=self.surface)
        return ActiveRayTracer(scene, threads=2).gbuffer(self.camera)

    def bounced(self, batches: int, seed: int = 0) -> tuple[Estimate, Timing]:
        """Return the irradiance by way of other walls, and its time on one core."""
        tracer = PathTracer(self.surface, bounces=BOUNCES, seed=seed, threads=1)
        tracer.light(self.gbuffer, self.camera, self.light, batches=2)
        timing, found = once(
            lambda: tracer.light(self.gbuffer, self.camera, self.light, batches=batches)
        )
        tracer.close()
        return (
            Estimate(
                found.irradiance.astype(float), found.standard_error.astype(float)
            ),
            timing,
        )

    def straight(self) -> Estimate:
        """Return the irradiance that comes straight from the scope; it has no noise."""
        walls = SeenWalls.of(self.gbuffer, self.camera, self.light)
        field = seen_field(self.surface.distance, self.camera)
        ends = self.light.sources(self.camera, SOURCES)
        light = fibre_light(self.light, self.camera, ends)
        found = np.zeros(walls.shown.shape)
        for row, column in np.argwhere(walls.shown):
            at, normal = walls.points[row, column], walls.normals[row, column]
            found[row, column] = direct(field, tuple(at), tuple(normal), light)
        mean = np.repeat(found[..., None], 3, axis=-1)
        return Estimate(mean, np.zeros_like(mean))
