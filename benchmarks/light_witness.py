"""Our light from wall to wall beside another program's, pixel by pixel."""

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from benchmarks.nasal_views import NasalView, acceptance_views, nasal_scene
from benchmarks.timing import Timing, measure
from renderers.art import ActiveRayTracer
from renderers.scene import AirSurface, GBuffer, Projection
from renderers.shading.kernels.path_tracing import direct
from renderers.shading.lit_walls import fibre_light, seen_field
from renderers.shading.path_tracer import SOURCES, PathTracer, SeenWalls
from renderers.shading.tissue_colour import colour_table

BLOOD_CODE = 20
"""Pale mucosa, red albedo .57: a third of the red light comes by way of other walls."""
BOUNCES = 12
EDGE_MM = 0.5
"""Depths of neighbouring pixels that differ by more lie on either side of an edge."""
VIEWS = ("turbinate", "choana")
OFF_BY_SIGMAS = 3.0


@dataclass(frozen=True, slots=True)
class Estimate:
    """Hold a picture and its standard error, both ``(h, w, 3)``."""

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
class Agreement:
    """Say how another estimate of the same light differs from ours.

    mean: relative difference of the means over all pixels and colours.
    mean_error: its standard error. rms: of the pixels' differences, over our mean;
    noise: what it would be by noise alone. beyond: share of values that are more than
    three standard errors apart, away from edges; beyond_at_edges: at them.
    """

    mean: float
    mean_error: float
    rms: float
    noise: float
    beyond: float
    beyond_at_edges: float

    @classmethod
    def of(
        cls, own: Estimate, theirs: Estimate, edges: NDArray[np.bool_]
    ) -> "Agreement":
        """Compare; edges: ``(h, w)`` pixels of edges."""
        unit = own.mean.mean()
        apart = theirs.mean - own.mean
        error = np.hypot(own.error, theirs.error)
        beyond = np.abs(apart) > OFF_BY_SIGMAS * error
        # a pixel's colours come by the same paths: their errors add up
        together = error.sum(axis=-1)
        return cls(
            float(apart.mean() / unit),
            float(np.sqrt((together**2).sum()) / apart.size / unit),
            float(np.sqrt((apart**2).mean()) / unit),
            float(np.sqrt((error**2).mean()) / unit),
            float(beyond[~edges].mean()),
            float(beyond[edges].mean()) if edges.any() else 0.0,
        )

    @property
    def is_same_light(self) -> bool:
        """Return whether noise explains the difference of the means."""
        return abs(self.mean) < OFF_BY_SIGMAS * self.mean_error

    @property
    def remains(self) -> float:
        """Return the root mean square difference that noise does not explain."""
        return math.sqrt(max(self.rms**2 - self.noise**2, 0.0))


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

    @cached_property
    def edges(self) -> NDArray[np.bool_]:
        """Return the pixels next to which something nearer or farther is seen."""
        depth = np.where(self.gbuffer.coverage > 0, self.gbuffer.depth_mm, 1e3)
        found = np.zeros(depth.shape, np.bool_)
        for axis in (0, 1):
            jump = np.abs(np.diff(depth, axis=axis)) > EDGE_MM
            before = [slice(None)] * 2
            after = [slice(None)] * 2
            before[axis], after[axis] = slice(None, -1), slice(1, None)
            found[tuple(before)] |= jump
            found[tuple(after)] |= jump
        return found

    def bounced(self, batches: int, seed: int = 0) -> tuple[Estimate, Timing]:
        """Return the irradiance by way of other walls, and its time on one core."""
        tracer = PathTracer(self.surface, bounces=BOUNCES, seed=seed, threads=1)
        tracer.light(self.gbuffer, self.camera, self.light, batches=2)
        timing, found = measure(
            lambda: tracer.light(
                self.gbuffer, self.camera, self.light, batches=batches
            ),
            least=1,
            most=1,
            warm_up=False,
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
