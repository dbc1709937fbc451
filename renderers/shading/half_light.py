"""Light a picture at half its size, and bring that to all of its pixels.

Light takes much of a frame's time, and changes less from pixel to pixel than what the
lens, the noise and the sharpening of the camera do.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from renderers.scene import Camera, GBuffer
from renderers.shading.bands import RowBands
from renderers.shading.kernels.half_light import (
    enlarge,
    find_edges,
    take_likest,
    widen,
)
from renderers.shading.mirrored_light import view_of

Picture = NDArray[np.float32]

HALF_FROM_PX = 640
"""Smaller pictures are lit in full: glints of a wound are a pixel or two wide there."""


def may_be_halved(size: tuple[int, int]) -> bool:
    """Return whether a picture ``(h, w)`` is large enough, and even."""
    return min(size) >= HALF_FROM_PX and size[0] % 2 == size[1] % 2 == 0


def half_lit(
    gbuffer: GBuffer,
    camera: Camera,
    paint: Callable[[GBuffer, Camera], Picture],
    bands: RowBands,
) -> Picture:
    """Return the radiance ``(h, w, 3)`` of a G-buffer of even size.

    paint: lights a G-buffer of half the size, whose camera is given beside it; its
    pixel shows what the first of four shows, seen along a ray between them.
    """
    height, width = gbuffer.size
    rows, columns = height // 2, width // 2
    small = camera.with_size(columns, rows)
    part = GBuffer.empty(rows, columns)
    edges = np.empty((rows, columns), np.uint8)
    rough = np.empty_like(edges)
    radiance = np.empty((height, width, 3), np.float32)
    seen = view_of(gbuffer, camera)

    def thin_out(first: int, last: int) -> None:
        here = slice(2 * first, 2 * last, 2), slice(None, None, 2)
        part.depth_mm[first:last] = gbuffer.depth_mm[here]
        part.normal[first:last] = gbuffer.normal[here]
        part.coverage[first:last] = gbuffer.coverage[here]
        part.material[first:last] = gbuffer.material[here]
        find_edges(seen, edges, first, last)

    bands.run(rows, thin_out)
    bands.run(rows, lambda first, last: widen(edges, rough, first, last))
    part = part.read_only()
    light, shown = paint(part, small), view_of(part, small)

    def bring(first: int, last: int) -> None:
        enlarge(light, rough, radiance, first, last)
        take_likest(seen, shown, light, rough, radiance, first, last)

    bands.run(rows, bring)
    return radiance
