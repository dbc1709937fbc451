"""Mirrored light and light through thin walls, added to a shaded picture."""

import math

import numpy as np
from numpy.typing import NDArray

from renderers.scene import AirSurface, Camera, GBuffer
from renderers.shading.bands import RowBands
from renderers.shading.bounce.light_grid import VirtualLights
from renderers.shading.illumination import Effects, ScopeLight
from renderers.shading.materials import F0, material_table
from renderers.shading.secondary.kernels import (
    FILM,
    MIRROR,
    THIN,
    blur_rows,
    follow_rows,
)
from renderers.shading.secondary.spread.kernels import W as TOGETHER
from renderers.shading.secondary.spread.kernels import add_rows
from renderers.shading.tissue_colour import SKIN_COLOR, colour_table

BLUR_SHARE = 32
"""Of a picture's width, over which what ground metal mirrors runs together."""


class SecondLight:
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
        self._bias_root = np.float32(math.sqrt(blood_bias))
        self._table = colour_table()
        self._skin = np.array(SKIN_COLOR, np.float32)
        self._reflect = np.ascontiguousarray(material_table()[:, F0])

    def add(
        self,
        radiance: NDArray[np.float32],
        gbuffer: GBuffer,
        camera: Camera,
        light: ScopeLight,
        lights: VirtualLights,
        sources: NDArray[np.float32],
        gain: float,
        bands: RowBands,
    ) -> None:
        """Change `radiance` ``(h, w, 3)`` in place. gain: of the bounce light."""
        bits = self._bits
        if not bits or (bits == MIRROR and is_all_tissue(gbuffer.material)):
            return
        distance = self._surface.distance
        voxel_from_world = distance.voxel_from_world
        eye = voxel_from_world[:3, :3] @ camera.eye_mm + voxel_from_world[:3, 3]
        height, width = gbuffer.size
        stride = self._stride
        grid = np.zeros((height // stride + 2, width // stride + 2, 6), np.float32)
        common = (
            gbuffer.depth_mm,
            gbuffer.normal,
            gbuffer.coverage,
            gbuffer.material,
            camera.lens_table(),
            camera.frame[1:].astype(np.float32),
            bits,
            stride,
            np.float32(gain),
            distance.values,
            voxel_from_world[:3, :3].astype(np.float32),
            eye.astype(np.float32),
            sources,
            camera.frame[3].astype(np.float32),
            np.float32(light.spread),
            np.float32(light.power / len(sources)),
            lights.table,
            self._table,
            self._surface.blood.values,
            self._surface.skin.values,
            self._skin,
            self._bias_root,
        )
        blurred = np.empty_like(grid)

        def follow(first: int, last: int) -> None:
            follow_rows(*common, grid, first, last)

        def blur(first: int, last: int) -> None:
            blur_rows(
                gbuffer.depth_mm,
                gbuffer.normal,
                gbuffer.material,
                stride,
                max(width // BLUR_SHARE, stride),
                grid,
                blurred,
                first,
                last,
            )

        def add(first: int, last: int) -> None:
            add_rows(*common, blurred, self._reflect, radiance, first, last)

        bands.run(len(grid), follow)
        bands.run(len(grid), blur)
        bands.run(height, add)


def is_all_tissue(material: NDArray[np.uint8]) -> bool:
    """Tell whether no pixel shows anything but tissue, which is material 0."""
    flat = material.reshape(-1)
    whole = len(flat) // 8 * 8
    # eight pixels at a time
    return not (flat[:whole].view(np.uint64).any() or flat[whole:].any())
