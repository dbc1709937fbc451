"""A fuzzy set drawn the 1995 way: shaded splats, one over the other.

Splats are culled by rows, projected, put in order of distance, listed per tile and
composited near to far, so that a tile is done when no light is left.
"""

import threading

import numpy as np
from numpy.typing import NDArray

from renderers.fsr.classic.kernel_set import KernelSet, best_kernels
from renderers.fsr.classic.mode import SplatMode
from renderers.fsr.classic.ordering.kernels import bin_splats, order_splats
from renderers.fsr.classic.painted_set import PaintedSet
from renderers.fsr.classic.projected_splats import SPARE, ProjectedSplats
from renderers.fsr.classic.projection.kernels import KEYS
from renderers.fsr.classic.scratch import TileScratch
from renderers.fsr.classic.tiles import (
    ACROSS,
    MOST_TILES,
    SIDE,
    TILE_SIDE,
)
from renderers.fsr.display_list import DisplayRoom, list_elements
from renderers.fsr.footprint import CUT_SIGMAS, SHEET_SIGMA_PER_SPACING
from renderers.fsr.fuzzy_set import FuzzySet
from renderers.fsr.thread_team import ThreadTeam
from renderers.scene import Camera, Image, Scene

LEAST_LIGHT = 1 / 1024
"""Light below which a square of pixels takes no more: a quarter of a code."""


class SplatRasterizer:
    """Draw pictures of mode `classic`; keeps its scratch memory between pictures.

    least_light: share of the light below which nothing is added; no picture differs
    from the one with none by more than this.
    """

    def __init__(
        self,
        fuzzy_set: FuzzySet,
        scene: Scene,
        *,
        kernels: KernelSet | None = None,
        least_light: float = LEAST_LIGHT,
    ) -> None:
        self._kernels = kernels or best_kernels()
        self._painted = PaintedSet(fuzzy_set, scene)
        self._row_count = fuzzy_set.rows.row_count
        spacing = scene.volume.spacing_mm
        self._margin = float(CUT_SIGMAS * SHEET_SIGMA_PER_SPACING * spacing.max())
        self._sheet_mm = float(np.prod(spacing) ** (1 / 3))
        self._least_light = least_light
        self._room = DisplayRoom(len(fuzzy_set), SPARE)
        self._splats = ProjectedSplats(self._painted, self._kernels.project_splats)
        self._counts = np.empty(KEYS, np.int32)
        self._ranges = np.empty(0, np.int32)
        self._numbers = np.empty(0, np.int32)
        self._items = np.empty(0, np.int32)
        self._local = threading.local()
        self.counters: dict[str, int] = {}

    def draw(
        self,
        camera: Camera,
        team: ThreadTeam,
        mode: SplatMode = SplatMode.GAUSSIAN,
        *,
        with_depth: bool = False,
        limit_mm: NDArray[np.float32] | None = None,
    ) -> Image:
        """Composite one view; the bits do not depend on the team's size.

        with_depth: find for every pixel the depth by which half of the light is gone,
        along the ray, or along the axis in an orthographic view. limit_mm: ``(h, w)``
        depth of something opaque, infinite where there is nothing; splats behind it
        are hidden per pixel. Raises ValueError where that does not fit the camera, and
        for a picture of too many pixels.
        """
        down, across = tile_grid(camera.height, camera.width)
        if limit_mm is not None and limit_mm.shape != (camera.height, camera.width):
            raise ValueError(
                f"depth limits of shape {limit_mm.shape} do not fit a picture of "
                f"{camera.height} x {camera.width}"
            )
        shown = list_elements(self._painted.rows, camera, self._margin, self._room)
        view = self._splats.update(self._room.index, shown.count, camera, mode, team)
        start = self._bin(down, across)
        keys = (
            np.float32(view.low),
            np.float32(view.keys_per_mm),
            np.float32(view.keys_per_mm * self._sheet_mm),
        )
        records = self._splats.records.reshape(-1)
        boxes = self._splats.boxes.reshape(-1)
        image = np.empty((camera.height, camera.width, 4), np.float32)
        depth = np.empty(image.shape[:2] if with_depth else (0, 0), np.float32)

        def draw(tile: int) -> int:
            row, column = divmod(tile, across)
            left, top = column * TILE_SIDE, row * TILE_SIDE
            scratch = self._scratch()
            limits = _tile_limits(limit_mm, left, top, scratch.limits)
            items = self._items[start[tile] : start[tile + 1]]
            head = records, boxes, items, left, top
            rest = (
                np.float32(self._least_light),
                with_depth,
                limits,
                scratch.columns,
                scratch.lines,
                scratch.state,
                scratch.depths,
            )
            if mode is not SplatMode.SHEET:
                points = mode is SplatMode.POINTS
                return self._kernels.draw_tile(*head, points, *rest, image, depth)
            sheets = scratch.sums, scratch.sheets, scratch.far
            return self._kernels.draw_sheets(*head, *keys, *rest, *sheets, image, depth)

        fragments = sum(team.map(draw, range(down * across)))
        self.counters = {
            "listed": shown.count,
            "visible": self._splats.visible,
            "split": self._splats.split,
            "rows": self._row_count,
            "culled rows": self._row_count - shown.rows_kept,
            "fragments": fragments,
        }
        return Image(image, depth if with_depth else None)

    def _bin(self, down: int, across: int) -> NDArray[np.int64]:
        n = self._splats.count
        if len(self._ranges) < n:
            self._ranges = np.empty(n * 5 // 4, np.int32)
            self._numbers = np.empty(n * 5 // 4, np.int32)
        order_splats(self._splats.heads, n, self._counts, self._ranges, self._numbers)
        start = np.zeros(down * across + 2, np.int64)
        while True:
            entries = bin_splats(
                self._ranges, self._numbers, n, across, down, start, self._items
            )
            if entries <= len(self._items):
                return start
            self._items = np.empty(entries * 3 // 2, np.int32)

    def _scratch(self) -> TileScratch:
        scratch: TileScratch | None = getattr(self._local, "scratch", None)
        if scratch is None:
            scratch = self._local.scratch = TileScratch()
        return scratch


def tile_grid(height: int, width: int) -> tuple[int, int]:
    """Give the tiles down and across a picture.

    Raises ValueError for a picture of more than `MOST_TILES` either way.
    """
    down, across = -(-height // TILE_SIDE), -(-width // TILE_SIDE)
    if max(down, across) > MOST_TILES:
        raise ValueError(
            f"a picture may have {MOST_TILES * TILE_SIDE} x "
            f"{MOST_TILES * TILE_SIDE} pixels, got {width} x {height}"
        )
    return down, across


def _tile_limits(
    limit_mm: NDArray[np.float32] | None,
    left: int,
    top: int,
    room: NDArray[np.float32],
) -> NDArray[np.float32]:
    """Lay a tile's part of the limits out in squares; nothing where there is none."""
    if limit_mm is None:
        return room[:0]
    tile = np.full((TILE_SIDE, TILE_SIDE), np.inf, np.float32)
    part = limit_mm[top : top + TILE_SIDE, left : left + TILE_SIDE]
    tile[: part.shape[0], : part.shape[1]] = part
    if np.all(np.isposinf(tile)):
        return room[:0]
    squares = tile.reshape(ACROSS, SIDE, ACROSS, SIDE).transpose(0, 2, 1, 3)
    room.reshape(squares.shape)[:] = squares
    return room
