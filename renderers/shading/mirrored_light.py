"""Mirrored light and light through thin walls, added to a shaded picture."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from renderers.scene import AirSurface, Camera, Change, GBuffer
from renderers.shading.bands import RowBands
from renderers.shading.bounce_light import VirtualLights
from renderers.shading.illumination import Effects, ScopeLight
from renderers.shading.kernels.follow_rays import (
    FILM,
    FOUND,
    MIRROR,
    THIN,
    BufferView,
    LitWalls,
    blur_mirrored,
    follow_rows,
)
from renderers.shading.kernels.upsample import W as TOGETHER
from renderers.shading.kernels.upsample import add_rows
from renderers.shading.lattice_points import dilated
from renderers.shading.lit_walls import fibre_light, seen_field, wall_colour
from renderers.shading.materials import F0, material_table
from renderers.shading.wounds import WallBlood

BLUR_SHARE = 32
"""Of a picture's width, over which what ground metal mirrors runs together."""


@dataclass(frozen=True, slots=True)
class Followed:
    """What was found at lattice points so far.

    found, blurred: float32 ``(gh, gw, FOUND)``, before and after metal is blurred.
    known: bool ``(gh, gw)``, the points that `found` has.
    """

    found: NDArray[np.float32]
    blurred: NDArray[np.float32]
    known: NDArray[np.bool_]

    @classmethod
    def empty(cls, size: tuple[int, int], stride: int) -> "Followed":
        """Begin a view of ``(h, w)`` pixels."""
        points = size[0] // stride + 2, size[1] // stride + 2
        found = np.zeros((*points, FOUND), np.float32)
        return cls(found, found.copy(), np.zeros(points, np.bool_))


class MirroredLight:
    """Add to radiance what comes by way of one more wall.

    The wall that is seen in a mirror, or that lights a thin wall from behind, is lit
    by the scope, with its shadows, and by virtual lights. It has the albedo of its
    blood and skin, without the fine mottle.

    stride: pixels from one point that is followed to the next. Raises ValueError where
    that is no multiple of four.
    """

    def __init__(
        self, surface: AirSurface, effects: Effects, stride: int, blood_bias: float
    ) -> None:
        if stride < 1 or stride % TOGETHER:
            raise ValueError(
                f"mirrors are followed every so many pixels, a multiple of {TOGETHER}; "
                f"got {stride}"
            )
        self._surface = surface
        self._bits = (
            FILM * effects.film_mirror
            + MIRROR * effects.metal_mirror
            + THIN * effects.thin_walls
        )
        self._stride = stride
        self._blood = WallBlood(surface)
        self._colour = wall_colour(surface, blood_bias, self._blood.codes)
        self._reflect = np.ascontiguousarray(material_table()[:, F0])

    def update(self, change: Change) -> None:
        """Bring the walls up to date after an edit in place."""
        self._blood.update(change)

    def follow(
        self,
        gbuffer: GBuffer,
        camera: Camera,
        walls: LitWalls,
        bands: RowBands,
        followed: Followed,
        points: NDArray[np.bool_],
    ) -> None:
        """Follow the light of lattice points, for `add`.

        walls: see `lit_walls`. points: ``(gh, gw)``, those wanted, and as far as
        `reach` says from them what is known already, or wanted, too.
        """
        if not self.wants(gbuffer):
            return
        reach = self.reach(gbuffer)
        fresh = dilated(points, reach) & ~followed.known
        view = view_of(gbuffer, camera)

        def follow(first: int, last: int) -> None:
            follow_rows(
                view,
                self._bits,
                self._stride,
                walls,
                fresh,
                followed.found,
                first,
                last,
            )

        def blur(first: int, last: int) -> None:
            blur_mirrored(
                gbuffer.depth_mm,
                gbuffer.normal,
                gbuffer.material,
                self._stride,
                max(gbuffer.size[1] // BLUR_SHARE, self._stride),
                points,
                followed.found,
                followed.blurred,
                first,
                last,
            )

        bands.run(len(fresh), follow)
        followed.known[fresh] = True
        bands.run(len(fresh), blur)

    def wants(self, gbuffer: GBuffer) -> bool:
        """Return whether a view has any of what is added here."""
        bits = self._bits
        return bits > 0 and not (bits == MIRROR and is_all_tissue(gbuffer.material))

    def reach(self, gbuffer: GBuffer) -> int:
        """Return the points to either side that what is blurred at one is made of."""
        if not self._bits & MIRROR or is_all_tissue(gbuffer.material):
            return 0
        return (max(gbuffer.size[1] // BLUR_SHARE, self._stride) - 1) // self._stride

    def add(
        self,
        radiance: NDArray[np.float32],
        gbuffer: GBuffer,
        camera: Camera,
        walls: LitWalls,
        bands: RowBands,
        followed: Followed,
        only: NDArray[np.bool_],
    ) -> None:
        """Change `radiance` ``(h, w, 3)`` in place. followed: by `follow`.

        only: ``(h, w)`` pixels to change.
        """
        # nothing was wanted, then; to look through the materials again takes longer
        if not followed.known.any():
            return
        view = view_of(gbuffer, camera)

        def add(first: int, last: int) -> None:
            add_rows(
                view,
                self._bits,
                self._stride,
                walls,
                followed.blurred,
                self._reflect,
                only,
                radiance,
                first,
                last,
            )

        bands.run(gbuffer.size[0], add)

    def lit_walls(
        self,
        camera: Camera,
        light: ScopeLight,
        lights: VirtualLights,
        sources: NDArray[np.float32],
        gain: float,
    ) -> LitWalls:
        """Return the walls of a view and the light on them; gain: of bounced light."""
        return LitWalls(
            seen_field(self._surface.distance, camera),
            fibre_light(light, camera, sources),
            self._colour,
            lights.table,
            np.float32(gain),
        )


def view_of(gbuffer: GBuffer, camera: Camera) -> BufferView:
    """Return a G-buffer and its rays as kernels take them."""
    return BufferView(
        gbuffer.depth_mm,
        gbuffer.normal,
        gbuffer.coverage,
        gbuffer.material,
        camera.lens_table(),
        camera.frame[1:].astype(np.float32),
    )


def is_all_tissue(material: NDArray[np.uint8]) -> bool:
    """Return whether no pixel shows anything but tissue, which is material 0."""
    # numpy finds the largest byte in half the time in which it finds any
    return int(material.max(initial=0)) == 0
