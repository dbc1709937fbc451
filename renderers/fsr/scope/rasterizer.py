"""A G-buffer from two sets of surfels: fine ones near the lens, coarse ones beyond."""

import math
import threading
from functools import partial

import numpy as np
from numpy.typing import NDArray

from renderers.fsr.culling.kernels import bin_boxes
from renderers.fsr.display_list import build_display_list
from renderers.fsr.occlusion import Blocks
from renderers.fsr.projection.kernels import RECORD, project_surfels
from renderers.fsr.scope.kernels import (
    PLANE,
    STRIP,
    STRIPS,
    TILE_FLOATS,
    TILE_HEIGHT,
    TILE_SHIFT_X,
    TILE_SHIFT_Y,
    TILE_WIDTH,
    draw_tile,
    fill_holes,
)
from renderers.fsr.surfels import Surfels, extract_surfels
from renderers.fsr.thread_team import ThreadTeam
from renderers.scene import Camera, GBuffer, Projection, Volume

SIGMA_PER_SPACING = 0.6
"""Wider discs cost detail (SSIM .005 less at .72), narrower ones leave holes."""

RADIUS_SIGMAS = math.sqrt(4.5)
"""The weight (1 - r^2 / 4.5 sigma^2)^2 is close to the Gaussian and ends smoothly. The
longer tail (1 - r^2 / 6 sigma^2)^3 changes no error and costs 15 % more (measured)."""

CORE_SIGMAS2 = 2.9
"""Squared core radius in sigmas; with 1.7 the far wall shows through pinholes."""

BEHIND_MM = 0.6
"""Depth behind the nearest core that belongs to the same surface."""

NEAR_SPACINGS = 16.0
"""Fine surfels nearer than this many coarse spacings (8 mm at 0.5 mm): there a coarse
disc is 30 pixels wide, silhouettes grow and small openings close."""

FACING = 0.004
"""Least cosine to the eye. A wall seen more flatly is less than a pixel high."""

HOLE_NEIGHBOURS = 5
"""Neighbours an empty pixel needs to count as a hole rather than as open air."""

REFRESH = 128
"""Surfels of a tile between two looks at its farthest depths."""

PART = 4096
"""Surfels projected at a time by one thread."""

NEAREST_MM = 1e-3


class SurfelRasterizer:
    """Draw the zero surface of a signed distance field (mm, negative in air).

    Keeps its scratch memory between pictures. hide: leave out what walls hide before
    it is projected. Without, the picture is slower and the same but for pinholes
    between discs, where something hidden may show.
    """

    def __init__(self, distance: Volume, *, hide: bool = True) -> None:
        self._coarse = extract_surfels(distance)
        self._fine = extract_surfels(distance, refine=2)
        self._blocks = Blocks(distance, self._coarse.rows, self._fine.rows)
        self._rows = self._coarse.rows.row_count + self._fine.rows.row_count
        self._hide = hide
        self._records = np.empty((0, RECORD), np.float32)
        self._boxes = np.empty((0, 4), np.int32)
        self._items = np.empty(0, np.int32)
        self._table = np.empty((0, 0, 3), np.float32)
        self._rays = np.empty((0, 0, 0), np.float32)
        self._local = threading.local()
        self.counters: dict[str, int] = {}

    @property
    def splat_count(self) -> int:
        """Get the number of surfels in both sets."""
        return len(self._coarse) + len(self._fine)

    def draw(self, camera: Camera, team: ThreadTeam) -> GBuffer:
        """Find the air surface; the bits do not depend on the team's size.

        Raises ValueError for an orthographic camera, whose rays do not meet.
        """
        if camera.projection is Projection.ORTHOGRAPHIC:
            raise ValueError(
                "a G-buffer of surfels needs an eye point; take an equidistant or "
                "perspective camera"
            )
        listed = self._project(camera, team)
        tiles, start = self._bin(camera, listed)
        result = GBuffer.empty(camera.height, camera.width)
        table = camera.lens_table()
        rays = self._strip_rays(table)
        across = -(-camera.width // TILE_WIDTH)

        def draw(tile: int) -> tuple[int, int]:
            buffer, far = self._scratch()
            fragments, hidden = draw_tile(
                self._records,
                self._boxes,
                self._items[start[tile] : start[tile + 1]],
                rays[tile],
                tile % across * TILE_WIDTH,
                tile // across * TILE_HEIGHT,
                np.float32(CORE_SIGMAS2 / RADIUS_SIGMAS**2),
                np.float32(BEHIND_MM),
                REFRESH,
                buffer,
                far,
                result.depth_mm,
                result.normal,
                result.coverage,
            )
            return fragments, hidden

        totals = team.map(draw, range(tiles))
        room = camera.width * camera.height // 16 + 16
        self.counters["holes filled"] = fill_holes(
            table,
            result.depth_mm,
            result.normal,
            result.coverage,
            HOLE_NEIGHBOURS,
            np.empty((room, 2), np.int32),
            np.empty((room, 4), np.float32),
        )
        self.counters["fragments"] = sum(f for f, _ in totals)
        self.counters["hidden"] = sum(h for _, h in totals)
        return result

    def _project(self, camera: Camera, team: ThreadTeam) -> int:
        near = NEAR_SPACINGS * self._coarse.spacing_mm
        reach = SIGMA_PER_SPACING * RADIUS_SIGMAS
        # coarse discs begin where they still reach under the last fine ones
        coarse_from = near - math.sqrt(CORE_SIGMAS2 / RADIUS_SIGMAS**2) * (
            reach * self._coarse.spacing_mm
        )
        room = len(self._coarse) + len(self._fine)
        if len(self._records) < room:
            self._records = np.empty((room, RECORD), np.float32)
            self._boxes = np.empty((room, 4), np.int32)
        # a grid point is up to half a spacing's diagonal from its surfel
        slack = self._coarse.spacing_mm
        blocks = self._blocks.visible(
            camera,
            team,
            radius_mm=reach * self._coarse.spacing_mm + slack,
            near_reach_mm=near,
            far_from_mm=coarse_from,
            hide=self._hide,
        )
        visible = kept = listed = 0
        for surfels, mask, low, high in (
            (self._fine, blocks.fine, NEAREST_MM, near),
            (self._coarse, blocks.coarse, coarse_from, math.inf),
        ):
            radius = reach * surfels.spacing_mm
            frame = camera.frame.copy()
            frame[0] -= surfels.rows.world_from_voxel[:3, 3]
            shown = build_display_list(
                surfels.rows,
                camera,
                radius + slack,
                reach_mm=high + slack,
                back_to_front=False,
                mask=mask,
            )
            project = partial(
                self._project_part,
                camera,
                surfels,
                shown.index,
                frame.astype(np.float32),
                (low, high, radius),
                listed,
            )
            visible += sum(team.map(project, range(0, len(shown), PART)))
            kept += shown.rows_kept
            listed += len(shown)
        self.counters = {
            "listed": listed,
            "visible": visible,
            "rows": self._rows,
            "culled rows": self._rows - kept,
            "blocks in view": blocks.in_view,
            "hidden blocks": blocks.hidden,
        }
        return listed

    def _project_part(
        self,
        camera: Camera,
        surfels: Surfels,
        index: NDArray[np.int32],
        frame: NDArray[np.float32],
        limits: tuple[float, float, float],
        base: int,
        first: int,
    ) -> int:
        nearest, farthest, radius = limits
        return int(
            project_surfels(
                index[first : first + PART],
                surfels.position,
                surfels.normal,
                frame,
                int(camera.projection),
                np.float32(camera.extent),
                camera.width,
                camera.height,
                np.float32(nearest),
                np.float32(farthest),
                np.float32(radius),
                np.float32(FACING),
                self._records,
                self._boxes,
                base + first,
            )
        )

    def _strip_rays(self, table: NDArray[np.float32]) -> NDArray[np.float32]:
        """Lay rays out as tiles want them: ``(tiles, strips, 3 * PLANE)``.

        Per strip the planes x, y, z of its 4 x 4 squares, zero beyond the picture.
        """
        if table is not self._table:
            height, width = table.shape[:2]
            down, across = -(-height // TILE_HEIGHT), -(-width // TILE_WIDTH)
            padded = np.zeros((down * TILE_HEIGHT, across * TILE_WIDTH, 3), np.float32)
            padded[:height, :width] = table
            squares = padded.reshape(down, STRIPS, STRIP, across, -1, STRIP, 3)
            # to tile row, tile column, strip, plane, square, row, column
            self._rays = np.ascontiguousarray(
                squares.transpose(0, 3, 1, 6, 4, 2, 5)
            ).reshape(down * across, STRIPS, 3 * PLANE)
            self._table = table
        return self._rays

    def _bin(self, camera: Camera, listed: int) -> tuple[int, NDArray[np.int64]]:
        across = -(-camera.width // TILE_WIDTH)
        down = -(-camera.height // TILE_HEIGHT)
        tiles = across * down
        start = np.zeros(tiles + 2, np.int64)
        while True:
            entries = bin_boxes(
                self._boxes,
                listed,
                across,
                down,
                TILE_SHIFT_X,
                TILE_SHIFT_Y,
                start,
                self._items,
            )
            if entries <= len(self._items):
                return tiles, start
            self._items = np.empty(entries * 3 // 2, np.int32)

    def _scratch(self) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        if not hasattr(self._local, "buffer"):
            self._local.buffer = np.empty(TILE_FLOATS, np.float32)
            blocks = TILE_WIDTH * TILE_HEIGHT // 256
            self._local.far = np.empty(blocks + 1, np.float32)
        return self._local.buffer, self._local.far
