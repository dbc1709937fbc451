"""Creases beside cuts of a splatted picture, as sharp as a ray sees them."""

import numpy as np
from numpy.typing import NDArray

from renderers.fsr.kernels.creases import (
    SHIFT,
    Eye,
    list_creases,
    trace_creases,
    write_creases,
)
from renderers.fsr.kernels.draw_surfels import Surface
from renderers.scene import AirSurface, Camera, Change, GBuffer
from renderers.scene.thread_team import ThreadTeam
from renderers.shading.lit_walls import seen_field
from renderers.shading.wounds import WoundCubes

PARTS_PER_THREAD = 8
"""Cuts lie unevenly over the rows."""

AROUND = 1
"""Voxels around a cube in which a cut may leave an edge in it."""

SPARE = 16
"""Numbers after the last of a queue: vectors store sixteen at a time."""


class CreaseTracer:
    """Follow the rays of pixels at the edges of cuts; nothing where nobody operates.

    surface: read in place.
    """

    def __init__(self, surface: AirSurface) -> None:
        self._distance = surface.distance
        self._cubes = WoundCubes(surface, SHIFT, AROUND)
        self._queues: list[NDArray[np.int32]] = []
        self._starts: list[NDArray[np.float32]] = []
        self._found: list[NDArray[np.float32]] = []

    def update(self, change: Change) -> None:
        """Look again for cuts where something changed."""
        self._cubes.update(change)

    def trace(self, camera: Camera, team: ThreadTeam, result: GBuffer) -> int:
        """Change `result` in place; return how many pixels were settled by rays.

        The bits do not depend on the team's size.
        """
        if not self._cubes.is_any:
            return 0
        eye = Eye(
            seen_field(self._distance, camera),
            camera.frame[1:].astype(np.float32),
            camera.lens_table(),
        )
        surface = Surface(result.depth_mm, result.normal, result.coverage)
        height, width = result.size
        parts = PARTS_PER_THREAD * team.threads if team.threads > 1 else 1
        edges = [height * part // parts for part in range(parts + 1)]
        pixels = max(np.diff(edges)) * width
        if len(self._queues) != parts or len(self._found[0]) != pixels + 1:
            # pages of which nothing is used cost nothing
            self._queues = [np.empty(pixels + SPARE, np.int32) for _ in range(parts)]
            self._starts = [np.empty(pixels + SPARE, np.float32) for _ in range(parts)]
            self._found = [np.empty((pixels + 1, 4), np.float32) for _ in range(parts)]

        def trace_part(part: int) -> int:
            queue, starts = self._queues[part], self._starts[part]
            listed = list_creases(
                eye,
                self._cubes.cubes,
                surface,
                edges[part],
                edges[part + 1],
                queue,
                starts,
            )
            return int(trace_creases(eye, queue, starts, listed, self._found[part]))

        # all are found before any is written: neighbours look at each other
        counts = team.map(trace_part, range(parts))
        for part, found in enumerate(counts):
            write_creases(surface, self._queues[part], found, self._found[part])
        return sum(counts)
