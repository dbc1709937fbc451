"""The one shader both renderers use: a G-buffer goes in, radiance comes out."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderers.scene import AirSurface, Camera, GBuffer, Projection
from renderers.scene.thread_team import ThreadTeam
from renderers.shading.bands import RowBands
from renderers.shading.bounce.light_grid import STRIDE, VirtualLights
from renderers.shading.hairs.hair_layer import HairLayer
from renderers.shading.illumination import Detail, Effects, ScopeLight, Tier
from renderers.shading.look import Look
from renderers.shading.paths.path_light import PathLight, demand_size
from renderers.shading.secondary.second_light import SecondLight
from renderers.shading.shadow.rods import Caster, rod_table
from renderers.shading.surface.kernels import shade_rows
from renderers.simd_guard import demand_vectors

BOUNCE_FACTOR = 1.15
"""Fitted over five nasal views against a path tracer with four bounces; the virtual
lights stand for the first bounce only."""


@dataclass(frozen=True, slots=True)
class Lattice:
    """Hold the light found on a coarse lattice of a view's pixels.

    lights: that bounce stands for. grid: of `VirtualLights.gather`. followed: of
    `SecondLight.follow`.
    """

    lights: VirtualLights
    grid: NDArray[np.float32]
    followed: NDArray[np.float32] | None


class ScopeShader:
    """Light the surfaces of a G-buffer with the scope's own light.

    surface: blood, skin and distance of the case. seed: of mottle, vessels and hairs.
    blood_bias: factor on all blood content; .4 is decongested, 1.9 inflamed.
    effects: in place of the tier's own.
    The same G-buffer, camera and light give the same bits for any `threads`. Raises
    VectorError where this numba does not compile vectors.
    """

    def __init__(
        self,
        surface: AirSurface,
        tier: Tier = Tier.LIVE,
        seed: int = 7,
        blood_bias: float = 1.0,
        threads: int | ThreadTeam = 2,
        effects: Effects | None = None,
    ) -> None:
        demand_vectors("The light of the endoscope")
        if not (math.isfinite(blood_bias) and 0 <= blood_bias <= 10):
            raise ValueError(f"blood bias must be within 0..10, got {blood_bias}")
        self.tier = tier
        self.blood_bias = blood_bias
        self._bands = RowBands(threads)
        self._look = Look.of(surface, seed)
        self.effects = tier.effects if effects is None else effects
        self._hairs = HairLayer(surface, seed) if self.effects.hairs else None
        self._second = SecondLight(
            surface, self.effects, tier.mirror_stride, blood_bias
        )

    def shade(
        self,
        gbuffer: GBuffer,
        camera: Camera,
        light: ScopeLight,
        bounce: PathLight | None = None,
        casters: Sequence[Caster] = (),
        only: NDArray[np.bool_] | None = None,
        lattice: "Lattice | None" = None,
    ) -> NDArray[np.float32]:
        """Give linear radiance ``(h, w, 3)`` float32, black where nothing is seen.

        bounce: light by way of other walls that stands in for the quick estimate of it
        (see `PathTracer`). casters: tools that stand in the light. only: ``(h, w)``
        pixels that are wanted, the others get anything. lattice: of the whole view; the
        pixels wanted then get the bits that they have in the whole picture, whatever
        the G-buffer holds elsewhere. The camera must have the G-buffer's size. The
        G-buffer is only read: surface detail never moves depth.
        """
        demand_size(gbuffer, camera)
        if camera.projection is Projection.ORTHOGRAPHIC:
            raise ValueError("scope light needs a lens with an eye, not orthographic")
        gbuffer = _read_only(gbuffer)
        seen = gbuffer
        if only is None:
            only = _all_of(gbuffer.size)
        else:
            only = np.ascontiguousarray(only, np.bool_)
            seen = replace(gbuffer, coverage=np.where(only, gbuffer.coverage, 0))
            seen = _read_only(seen)
        rods = rod_table(casters if self.effects.tool_shadow else (), camera)
        sources = light.sources(camera, self.tier.sources)
        lattice = lattice or self.lattice(gbuffer, camera, light)
        if bounce is None:
            radiance = self._paint(seen, camera, light, lattice.grid, rods)
        elif bounce.irradiance.shape == (*gbuffer.size, 3):
            dark = VirtualLights.dark_grid(gbuffer)
            radiance = self._paint(seen, camera, light, dark, rods)
            reflected = self.reflectance(seen, camera, light)
            reflected *= bounce.irradiance
            radiance += reflected
        else:
            raise ValueError(
                f"light of {bounce.irradiance.shape} does not fit a G-buffer of "
                f"{gbuffer.size}"
            )
        self._second.add(
            radiance,
            gbuffer,
            camera,
            light,
            lattice.lights,
            sources,
            BOUNCE_FACTOR,
            self._bands,
            lattice.followed,
            only,
        )
        if self._hairs is not None:
            self._hairs.add(radiance, gbuffer, camera, light, sources, self._bands)
        return radiance

    def reflectance(
        self, gbuffer: GBuffer, camera: Camera, light: ScopeLight
    ) -> NDArray[np.float32]:
        """Give the radiance ``(h, w, 3)`` that a unit of bounced irradiance makes."""
        demand_size(gbuffer, camera)
        gbuffer = _read_only(gbuffer)
        dark = VirtualLights.dark_grid(gbuffer)
        rods = rod_table((), camera)
        found = self._paint(gbuffer, camera, light, dark, rods, lit=False)
        found *= np.float32(1 / math.pi)
        return found

    @property
    def lattice_px(self) -> int:
        """Get the stride of the lattice of pixels by which pictures are lit.

        Its points are the pixels whose row and column are multiples of it, or the last.
        """
        return math.gcd(STRIDE, self.tier.mirror_stride)

    def lattice(self, gbuffer: GBuffer, camera: Camera, light: ScopeLight) -> "Lattice":
        """Find the light of the lattice of a view; no other pixel counts.

        With it `shade` need not find it again.
        """
        demand_size(gbuffer, camera)
        gbuffer = _read_only(gbuffer)
        sources = light.sources(camera, self.tier.sources)
        lights = VirtualLights.trace(
            self._look.distance, camera, light, self.tier.virtual_lights
        )
        grid = lights.gather(gbuffer, camera, self._bands)
        followed = self._second.follow(
            gbuffer, camera, light, lights, sources, BOUNCE_FACTOR, self._bands
        )
        return Lattice(lights, grid, followed)

    def _paint(
        self,
        gbuffer: GBuffer,
        camera: Camera,
        light: ScopeLight,
        grid: NDArray[np.float32],
        rods: NDArray[np.float32],
        *,
        lit: bool = True,
    ) -> NDArray[np.float32]:
        look = self._look
        voxel_from_world = look.distance.voxel_from_world
        eye_voxel = voxel_from_world[:3, :3] @ camera.eye_mm + voxel_from_world[:3, 3]
        lens = camera.lens_table()
        axes = camera.frame[1:].astype(np.float32)
        to_voxel = voxel_from_world[:3, :3].astype(np.float32)
        eye_in_voxels = eye_voxel.astype(np.float32)
        eye_mm = (camera.eye_mm - look.distance.center_mm).astype(np.float32)
        sources = light.sources(camera, self.tier.sources)
        arcs = light.arcs(camera, self.tier.sources)
        radiance = np.empty((*gbuffer.size, 3), np.float32)

        def rows(first: int, last: int) -> None:
            shade_rows(
                gbuffer.depth_mm,
                gbuffer.normal,
                gbuffer.coverage,
                gbuffer.material,
                lens,
                axes,
                to_voxel,
                eye_in_voxels,
                eye_mm,
                np.float32(camera.radians_per_pixel),
                sources,
                arcs,
                rods,
                np.float32(light.spread),
                np.float32(light.power),
                grid,
                np.float32(BOUNCE_FACTOR),
                look.tint,
                look.distance.shape,
                np.float32(self.blood_bias),
                look.colours,
                look.skin,
                look.materials,
                self.tier.detail is Detail.FULL,
                look.tile.quads,
                look.tile.unit,
                look.vessel_tile.quads,
                look.vessel_tile.unit,
                look.to_tile,
                look.vessel_offset_mm,
                lit,
                radiance,
                first,
                last,
            )

        self._bands.run(gbuffer.size[0], rows)
        return radiance

    def close(self) -> None:
        """End the threads."""
        self._bands.close()


@lru_cache(maxsize=1)
def _all_of(size: tuple[int, int]) -> NDArray[np.bool_]:
    return np.ones(size, np.bool_)


def _read_only(gbuffer: GBuffer) -> GBuffer:
    """View the buffer so that it cannot be written, whatever the caller can do.

    Writable and read-only arrays are different types to a compiled kernel: without
    this it would be compiled twice.
    """

    def view(array: NDArray[Any]) -> NDArray[Any]:
        if array.flags.c_contiguous and not array.flags.writeable:
            return array
        result = np.ascontiguousarray(array).view()
        result.flags.writeable = False
        return result

    return GBuffer(
        view(gbuffer.depth_mm),
        view(gbuffer.normal),
        view(gbuffer.coverage),
        view(gbuffer.material),
    )
