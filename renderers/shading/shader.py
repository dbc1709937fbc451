"""The one shader both renderers use: a G-buffer goes in, radiance comes out."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from renderers.scene import (
    AirSurface,
    Camera,
    Change,
    ChangeKind,
    GBuffer,
    Projection,
)
from renderers.scene.thread_pool import ThreadPool
from renderers.shading.bands import RowBands
from renderers.shading.bounce_light import STRIDE, VirtualLights
from renderers.shading.capsules import Caster, capsule_table
from renderers.shading.hairs import HairLayer, PlacedStrands, draw_hairs
from renderers.shading.half_light import half_lit, may_be_halved
from renderers.shading.illumination import Detail, Effects, ScopeLight, Tier
from renderers.shading.kernels.follow_rays import LitWalls
from renderers.shading.kernels.shade_rows import Bounced, Shadows, shade_rows
from renderers.shading.lattice_points import asked_points, dilated, pixels_of
from renderers.shading.lit_walls import fibre_light, seen_field
from renderers.shading.mirrored_light import Followed, MirroredLight, view_of
from renderers.shading.path_tracer import PathLight, require_size
from renderers.shading.surface_look import surface_tables, tint_of
from renderers.shading.wounds import WoundLook, blood_codes
from renderers.simd.self_check import require_vectors

BOUNCE_FACTOR = 1.15
"""Fitted over five nasal views against a path tracer with four bounces; the virtual
lights stand for the first bounce only."""


@dataclass(frozen=True, slots=True)
class Lattice:
    """The light found so far on a coarse lattice of a view's pixels.

    And what of a view's light asks for no G-buffer. lights: that bounce stands for.
    walls: lit by them and by the scope. shadows: of the tools in the light. hairs:
    those in view. grid: of `VirtualLights.gather`; gathered: the points that it has.
    followed: of `MirroredLight.follow`.
    """

    lights: VirtualLights
    walls: LitWalls
    shadows: Shadows
    hairs: PlacedStrands | None
    grid: NDArray[np.float32]
    gathered: NDArray[np.bool_]
    followed: Followed


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
        threads: int | ThreadPool = 2,
        effects: Effects | None = None,
    ) -> None:
        require_vectors("The light of the endoscope")
        if not (math.isfinite(blood_bias) and 0 <= blood_bias <= 10):
            raise ValueError(f"blood bias must be within 0..10, got {blood_bias}")
        self.tier = tier
        self.blood_bias = blood_bias
        self._bands = RowBands(threads)
        self._surface = surface
        self._distance = surface.distance
        self._tint = tint_of(blood_codes(surface), surface.skin.values)
        self._tables = surface_tables(
            self._tint, seed, blood_bias, tier.detail is Detail.FULL
        )
        self._wounds = WoundLook(surface)
        self.effects = tier.effects if effects is None else effects
        self._hairs = HairLayer(surface, seed) if self.effects.hairs else None
        self._mirrored = MirroredLight(
            surface, self.effects, tier.mirror_stride, blood_bias
        )

    def update(self, change: Change) -> None:
        """Bring what was made from the surface up to date after an edit in place.

        Pictures are then those of a new shader, to the bit. What is edited: distance,
        blood and skin of the surface, the film of its wounds and their pallor.
        """
        for update in self.updates:
            update(change)

    @property
    def updates(self) -> list[Callable[[Change], None]]:
        """Return the parts of `update`, which may be done beside each other."""
        return [self._update_tissue, self._update_wounds, self._mirrored.update]

    def _update_tissue(self, change: Change) -> None:
        low, high = change.low, change.high
        here = tuple(slice(low[a], high[a] + 1) for a in (2, 1, 0))
        if change.kind is not ChangeKind.FILM:
            skin = self._surface.skin.values[here]
            self._tint[here] = tint_of(blood_codes(self._surface, here), skin)
        if change.kind in (ChangeKind.CUT, ChangeKind.DENT) and self._hairs is not None:
            self._hairs.update(change)

    def _update_wounds(self, change: Change) -> None:
        if change.kind is not ChangeKind.TINT:
            self._wounds.update(change)

    def shade(
        self,
        gbuffer: GBuffer,
        camera: Camera,
        light: ScopeLight,
        bounce: PathLight | None = None,
        casters: Sequence[Caster] = (),
        only: NDArray[np.bool_] | None = None,
        lattice: Lattice | None = None,
    ) -> NDArray[np.float32]:
        """Return linear radiance ``(h, w, 3)`` float32, black where nothing is seen.

        bounce: light by way of other walls that stands in for the quick estimate of it
        (see `PathTracer`). casters: tools that stand in the light; none beside a
        lattice, which has its own. only: ``(h, w)`` pixels that are wanted, the others
        get anything. These get the bits that they have in the whole picture if the
        G-buffer has what `lattice_pixels` says, whatever it holds elsewhere; but for
        tiers of half light, which then light in full. lattice: of the same view; what
        it lacks is found and added to it. The camera must have the G-buffer's size.
        The G-buffer is only read: surface detail never moves depth.
        """
        require_size(gbuffer, camera)
        if camera.projection is Projection.ORTHOGRAPHIC:
            raise ValueError("scope light needs a lens with an eye, not orthographic")
        gbuffer = gbuffer.read_only()
        seen = gbuffer
        if only is not None:
            only = np.ascontiguousarray(only, np.bool_)
            seen = replace(gbuffer, coverage=np.where(only, gbuffer.coverage, 0))
            seen = seen.read_only()
        if lattice is None:
            lattice = self.lattice(gbuffer.size, camera, light, casters)
        elif casters:
            raise ValueError(
                f"{len(casters)} tools beside a lattice, which has its own; give them "
                "to `lattice`"
            )
        shadows = lattice.shadows
        is_whole = bounce is None and only is None
        halves = is_whole and self.tier.half_light and may_be_halved(gbuffer.size)
        self._extend(lattice, gbuffer, camera, only, gathers=not halves)
        if halves:
            radiance = self._half_lit(gbuffer, camera, light, lattice)
        elif bounce is None:
            radiance = self._paint(seen, camera, light, shadows, lattice.grid)
        elif bounce.irradiance.shape == (*gbuffer.size, 3):
            dark = VirtualLights.dark_grid(gbuffer.size)
            radiance = self._paint(seen, camera, light, shadows, dark)
            reflected = self.reflectance(seen, camera, light)
            reflected *= bounce.irradiance
            radiance += reflected
        else:
            raise ValueError(
                f"light of {bounce.irradiance.shape} does not fit a G-buffer of "
                f"{gbuffer.size}"
            )
        self._mirrored.add(
            radiance,
            gbuffer,
            camera,
            lattice.walls,
            self._bands,
            lattice.followed,
            _all_of(gbuffer.size) if only is None else only,
        )
        if lattice.hairs is not None:
            draw_hairs(lattice.hairs, radiance, gbuffer, camera, self._bands)
        return radiance

    def reflectance(
        self, gbuffer: GBuffer, camera: Camera, light: ScopeLight
    ) -> NDArray[np.float32]:
        """Return the radiance ``(h, w, 3)`` that a unit of bounced irradiance makes."""
        require_size(gbuffer, camera)
        gbuffer = gbuffer.read_only()
        dark = VirtualLights.dark_grid(gbuffer.size)
        shadows = self._shadows(camera, light, ())
        found = self._paint(gbuffer, camera, light, shadows, dark, lit=False)
        found *= np.float32(1 / math.pi)
        return found

    def lattice_pixels(
        self, gbuffer: GBuffer, only: NDArray[np.bool_]
    ) -> NDArray[np.bool_]:
        """Mark the pixels ``(h, w)`` whose G-buffer lights those of `only`.

        Besides their own. gbuffer: with all tools there are, hidden or not; its tissue
        may be missing.
        """
        points = asked_points(only, gbuffer.size, STRIDE)
        pixels = pixels_of(points, STRIDE, gbuffer.size)
        if self._mirrored.wants(gbuffer):
            stride = self.tier.mirror_stride
            points = asked_points(only, gbuffer.size, stride)
            reach = self._mirrored.reach(gbuffer)
            pixels |= pixels_of(dilated(points, reach), stride, gbuffer.size)
        return pixels

    def lattice(
        self,
        size: tuple[int, int],
        camera: Camera,
        light: ScopeLight,
        casters: Sequence[Caster] = (),
    ) -> Lattice:
        """Begin the lattice of a view ``(h, w)``: no point of it is lit yet.

        casters: tools that stand in the light.
        """
        lights = VirtualLights.trace(
            self._distance, camera, light, self.tier.virtual_lights
        )
        grid = VirtualLights.dark_grid(size)
        followed = Followed.empty(size, self.tier.mirror_stride)
        shadows = self._shadows(camera, light, casters)
        sources = light.sources(camera, self.tier.sources)
        hairs = None
        if self._hairs is not None:
            hairs = self._hairs.place(camera, light, sources)
        gathered = np.zeros(grid.shape[1:], np.bool_)
        walls = self._mirrored.lit_walls(camera, light, lights, sources, BOUNCE_FACTOR)
        return Lattice(lights, walls, shadows, hairs, grid, gathered, followed)

    def _shadows(
        self, camera: Camera, light: ScopeLight, casters: Sequence[Caster]
    ) -> Shadows:
        """Return what tools hide of the light of the fibres' ends."""
        capsules = capsule_table(casters if self.effects.tool_shadow else (), camera)
        return Shadows(light.arcs(camera, self.tier.sources), capsules)

    def _extend(
        self,
        lattice: Lattice,
        gbuffer: GBuffer,
        camera: Camera,
        only: NDArray[np.bool_] | None,
        *,
        gathers: bool,
    ) -> None:
        """Light the points of a lattice that the pixels of `only`, or all, ask for.

        gathers: light by way of walls, too, not what is mirrored alone.
        """
        fresh = asked_points(only, gbuffer.size, STRIDE) & ~lattice.gathered
        if gathers and fresh.any():
            lattice.lights.gather(gbuffer, camera, self._bands, fresh, lattice.grid)
            lattice.gathered[fresh] = True
        self._mirrored.follow(
            gbuffer,
            camera,
            lattice.walls,
            self._bands,
            lattice.followed,
            asked_points(only, gbuffer.size, self.tier.mirror_stride),
        )

    def _half_lit(
        self, gbuffer: GBuffer, camera: Camera, light: ScopeLight, lattice: Lattice
    ) -> NDArray[np.float32]:
        def paint(half: GBuffer, camera: Camera) -> NDArray[np.float32]:
            grid = lattice.lights.gather(half, camera, self._bands)
            return self._paint(half, camera, light, lattice.shadows, grid)

        return half_lit(gbuffer, camera, paint, self._bands)

    def _paint(
        self,
        gbuffer: GBuffer,
        camera: Camera,
        light: ScopeLight,
        shadows: Shadows,
        grid: NDArray[np.float32],
        *,
        lit: bool = True,
    ) -> NDArray[np.float32]:
        view, field = view_of(gbuffer, camera), seen_field(self._distance, camera)
        eye_mm = (camera.eye_mm - self._distance.center_mm).astype(np.float32)
        sources = light.sources(camera, self.tier.sources)
        beam = fibre_light(light, camera, sources)
        # rounded before it is divided, as in all pictures so far
        beam = beam._replace(each=np.float32(light.power) / np.float32(len(sources)))
        radiance = np.empty((*gbuffer.size, 3), np.float32)
        turns = np.zeros(1, np.int64)

        def paint(_: int) -> None:
            shade_rows(
                view,
                field,
                eye_mm,
                np.float32(camera.radians_per_pixel),
                beam,
                shadows,
                Bounced(grid, np.float32(BOUNCE_FACTOR)),
                self._tables,
                self._wounds.field,
                lit,
                radiance,
                turns,
            )

        self._bands.pool.map(paint, range(self._bands.threads))
        return radiance

    def close(self) -> None:
        """End the threads."""
        self._bands.close()


@lru_cache(maxsize=1)
def _all_of(size: tuple[int, int]) -> NDArray[np.bool_]:
    return np.ones(size, np.bool_)
