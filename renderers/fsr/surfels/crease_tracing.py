"""Creases beside cuts of a splatted picture, as sharp as a ray sees them."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderers.fsr.kernels.creases import (
    SHIFT,
    Eye,
    list_beside,
    list_creases,
    trace_creases,
    write_creases,
)
from renderers.fsr.kernels.draw_surfels import GeometryPlanes
from renderers.scene import AirSurface, Camera, Change, GBuffer
from renderers.scene.thread_pool import ThreadPool
from renderers.shading.lit_walls import seen_field
from renderers.shading.wounds import WoundCubes

PARTS_PER_THREAD = 8
"""Cuts lie unevenly over the rows."""

AROUND = 1
"""Voxels around a cube in which a cut may leave an edge in it."""

SPARE = 16
"""Numbers after the last of a queue: vectors store sixteen at a time."""


class Scratch(NamedTuple):
    """The memory of a list of rays; see `trace_creases`."""

    queue: NDArray[np.int32]
    starts: NDArray[np.float32]
    found: NDArray[np.float32]

    @classmethod
    def of(cls, pixels: int) -> "Scratch":
        """Get it for so many pixels."""
        return cls(
            np.empty(pixels + SPARE, np.int32),
            np.empty(pixels + SPARE, np.float32),
            np.empty((pixels + 1, 4), np.float32),
        )


class CreaseTracer:
    """Follow the rays of pixels at the edges of cuts; nothing where nobody operates.

    surface: read in place.
    """

    def __init__(self, surface: AirSurface) -> None:
        self._distance = surface.distance
        self._cubes = WoundCubes(surface, SHIFT, AROUND)
        self._size = (0, 0, 0)
        self._parts: list[Scratch] = []
        self._rest = Scratch.of(0)
        self._moved: NDArray[np.int32] = np.empty(0, np.int32)

    def update(self, change: Change) -> None:
        """Look again for cuts where something changed."""
        self._cubes.update(change)

    def trace(self, camera: Camera, pool: ThreadPool, result: GBuffer) -> int:
        """Change `result` in place; return how many pixels were settled by rays.

        The bits do not depend on the pool's size.
        """
        if not self._cubes.is_any:
            return 0
        eye = Eye(
            seen_field(self._distance, camera),
            camera.frame[1:].astype(np.float32),
            camera.lens_table(),
        )
        surface = GeometryPlanes(result.depth_mm, result.normal, result.coverage)
        height, width = result.size
        state = np.zeros(height * width, np.uint8)
        parts = PARTS_PER_THREAD * pool.threads if pool.threads > 1 else 1
        edges = [height * part // parts for part in range(parts + 1)]
        self._reserve(parts, int(max(np.diff(edges))) * width, height * width)

        def trace_part(part: int) -> int:
            scratch = self._parts[part]
            listed = list_creases(
                eye,
                self._cubes.cubes,
                surface,
                edges[part],
                edges[part + 1],
                scratch.queue,
                scratch.starts,
                state,
            )
            return int(trace_creases(eye, *scratch, listed))

        # all are found before any is written: neighbours look at each other
        counts = pool.map(trace_part, range(parts))
        moved, many = self._moved, 0
        for scratch, found in zip(self._parts, counts, strict=True):
            many = write_creases(
                surface, scratch.queue, found, scratch.found, moved, many
            )
        settled, scratch = sum(counts), self._rest
        while many:
            listed = list_beside(
                moved,
                many,
                eye,
                surface.depth,
                state,
                scratch.queue,
                scratch.starts,
            )
            found = trace_creases(eye, *scratch, listed)
            many = write_creases(surface, scratch.queue, found, scratch.found, moved, 0)
            settled += found
        return settled

    def _reserve(self, parts: int, pixels: int, all_pixels: int) -> None:
        """Get scratch memory; pages of which nothing is used cost nothing."""
        size = parts, pixels, all_pixels
        if self._size != size:
            self._size = size
            self._parts = [Scratch.of(pixels) for _ in range(parts)]
            self._rest = Scratch.of(all_pixels)
            self._moved = np.empty(all_pixels, np.int32)
