"""Rims of a splatted picture made as sharp as the surface."""

import numpy as np
from numpy.typing import NDArray

from renderers.fsr.kernels.rims import sharpen, write_moved
from renderers.scene import Camera, GBuffer, Volume
from renderers.scene.thread_pool import ThreadPool

PARTS_PER_THREAD = 8
"""Rims lie unevenly over the rows."""

SPARE = 16
"""Numbers after the last of a queue: vectors load sixteen at a time."""


class RimSharpener:
    """Take discs away where they stand over a free edge; keeps its scratch memory.

    distance: signed, mm, whose zero set the discs cover.
    """

    def __init__(self, distance: Volume) -> None:
        self._distance = distance
        self._queues = np.empty((0, 0), np.int32)
        self._found = np.empty((0, 4), np.float32)
        self._state = np.empty(0, np.uint8)

    @property
    def done(self) -> NDArray[np.uint8]:
        """Return the mask of the next picture's pixels whose rays are not traced."""
        return self._state

    def sharpen(
        self, camera: Camera, pool: ThreadPool, result: GBuffer
    ) -> tuple[int, int]:
        """Change `result` in place, after `begin`.

        Returns how many pixels' rays were traced and how many went to another wall;
        they may count a pixel twice where threads meet, but the bits of the picture do
        not depend on the pool's size.
        """
        to_voxel = self._distance.voxel_from_world
        eye = to_voxel[:3, :3] @ camera.eye_mm + to_voxel[:3, 3]
        height = result.size[0]
        parts = len(self._queues)
        edges = [height * part // parts for part in range(parts + 1)]
        common = (
            self._distance.values,
            to_voxel[:3, :3].astype(np.float32),
            eye.astype(np.float32),
            camera.frame[1:].astype(np.float32),
            camera.lens_table(),
            result.depth_mm,
        )

        def sharpen_rows(part: int) -> tuple[int, int]:
            traced, moved = sharpen(
                *common,
                edges[part],
                edges[part + 1],
                self._queues[part],
                self._state,
                self._found,
            )
            return traced, moved

        totals = pool.map(sharpen_rows, range(parts))
        moved: NDArray[np.int32] = np.array([t[1] for t in totals], np.int32)
        write_moved(self._queues, moved, self._found, result.depth_mm, result.normal)
        return sum(t[0] for t in totals), int(moved.sum())

    def begin(self, pool: ThreadPool, pixels: int) -> None:
        """Get scratch memory for a picture of so many pixels, none of them done."""
        parts = PARTS_PER_THREAD * pool.threads if pool.threads > 1 else 1
        if self._queues.shape != (parts, pixels + SPARE):
            # pages of which nothing is used cost nothing
            self._queues = np.empty((parts, pixels + SPARE), np.int32)
        if len(self._state) != pixels:
            self._state = np.empty(pixels, np.uint8)
            # one more for lanes that are not wanted
            self._found = np.empty((pixels + 1, 4), np.float32)
        self._state[:] = 0
