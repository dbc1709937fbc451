"""A fuzzy set drawn the 1995 way: shaded splats, one over the other.

Two stages that may run at the same time for two pictures, as in 1995: splats are
culled by rows; then taken shell by shell, projected, put in order and composited near
to far in tiles, so that a tile is done when no light is left.
"""

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from renderers.fsr.classic.kernel_set import KernelSet, best_kernels
from renderers.fsr.classic.kernels import FRAGMENT_BITS
from renderers.fsr.classic.mode import SplatMode, Traversal
from renderers.fsr.classic.painted_set import PaintedSet
from renderers.fsr.classic.projected_splats import ProjectedSplats
from renderers.fsr.classic.scratch import TileScratch, TileStates
from renderers.fsr.classic.splat_list import SplatList, list_splats
from renderers.fsr.classic.taken_splats import Piece, TakenSplats
from renderers.fsr.classic.tiles import MOST_TILES, TILE_SIDE
from renderers.fsr.fuzzy_set import FuzzySet
from renderers.fsr.tile_grid import tile_grid
from renderers.scene import Camera, Image, Scene
from renderers.scene.thread_team import ThreadTeam

LEAST_LIGHT = 1 / 1024
"""Light below which a square of pixels takes no more: a quarter of a code."""

MANY = 500
"""Splats that take long enough to draw for others to make use of it."""


@dataclass(frozen=True, slots=True)
class Canvas:
    """Hold a picture being drawn; depth and limits without elements are not wanted."""

    image: NDArray[np.float32]
    depth: NDArray[np.float32]
    limit_mm: NDArray[np.float32]


class Clock:
    """Add wall-clock time to stages as they end."""

    def __init__(self, stage_s: dict[str, float]) -> None:
        self._stage_s = stage_s
        self._last = time.perf_counter()

    def passed(self, stage: str) -> None:
        """Add what has passed since the last call."""
        now = time.perf_counter()
        self._stage_s[stage] += now - self._last
        self._last = now


class SplatRasterizer:
    """Draw pictures of mode `classic`; keeps its scratch memory between pictures.

    least_light: share of the light below which nothing is added; no picture differs
    from the one with none by more than this. counters, stage_s: what the last picture
    took, and wall-clock seconds by stage.
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
        self._least_light = least_light
        self._taken = TakenSplats(self._painted)
        self._splats = ProjectedSplats(self._kernels)
        self._tiles = TileStates(1, 1, False)
        self._local = threading.local()
        self.counters: dict[str, int] = {}
        self.stage_s: dict[str, float] = {}

    def draw(
        self,
        camera: Camera,
        team: ThreadTeam,
        mode: SplatMode = SplatMode.GAUSSIAN,
        traversal: Traversal = Traversal.DISTANCE,
        *,
        with_depth: bool = False,
        limit_mm: NDArray[np.float32] | None = None,
    ) -> Image:
        """Do both stages for one view: `prepare` and `draw_list`."""
        began = time.perf_counter()
        splats = self.prepare(camera, mode, traversal)
        culled = time.perf_counter() - began
        image = self.draw_list(splats, team, with_depth=with_depth, limit_mm=limit_mm)
        self.stage_s = {"cull": culled, **self.stage_s}
        return image

    def prepare(
        self, camera: Camera, mode: SplatMode, traversal: Traversal = Traversal.DISTANCE
    ) -> SplatList:
        """Cull one view: the first stage. It may run while another view is drawn."""
        return list_splats(self._painted, self._kernels, camera, mode, traversal)

    def draw_list(
        self,
        splats: SplatList,
        team: ThreadTeam,
        *,
        with_depth: bool = False,
        limit_mm: NDArray[np.float32] | None = None,
        meanwhile: Callable[[], object] | None = None,
    ) -> Image:
        """Composite a list: the second stage. Bits do not depend on the team's size.

        with_depth: find for every pixel the depth by which half of the light is gone,
        along the ray, or along the axis in an orthographic view. limit_mm: ``(h, w)``
        depth of something opaque, infinite where there is nothing; splats behind it
        are hidden per pixel. meanwhile: is called once, before tiles are drawn: what
        another thread then does in Python holds nothing up. Raises ValueError where
        limits do not fit the camera, and for a picture of too many pixels.
        """
        size = splats.camera.height, splats.camera.width
        down, across = tile_grid(*size, (TILE_SIDE, TILE_SIDE), MOST_TILES)
        if limit_mm is not None and limit_mm.shape != size:
            raise ValueError(
                f"depth limits of shape {limit_mm.shape} do not fit a picture of "
                f"{size[0]} x {size[1]}"
            )
        if self._tiles.shape != (down, across, with_depth):
            self._tiles = TileStates(down, across, with_depth)
        else:
            self._tiles.begin()
        canvas = Canvas(
            np.empty((*size, 4), np.float32),
            np.empty(size if with_depth else (0, 0), np.float32),
            np.empty((0, 0), np.float32) if limit_mm is None else limit_mm,
        )
        fragments = visible = 0
        self.stage_s = dict.fromkeys(("project", "order", "draw"), 0.0)
        clock = Clock(self.stage_s)
        for piece in self._taken.pieces(splats, self._tiles):
            if piece.parts == 0 and not piece.last:
                continue
            self._splats.project(piece, splats, team)
            clock.passed("project")
            self._splats.order(piece, team)
            clock.passed("order")
            if meanwhile and self._splats.visible >= MANY:
                meanwhile()
                meanwhile = None
            fragments += self._draw_piece(piece, splats, canvas, team)
            clock.passed("draw")
            visible += self._splats.visible
            if not self._tiles.alive.any():
                break
        if meanwhile:
            meanwhile()
        self.counters = {
            "listed": splats.count,
            "visible": visible,
            "split": splats.near.split,
            "rows": self._row_count,
            "culled rows": self._row_count - len(splats.spans),
            "fragments": fragments >> FRAGMENT_BITS,
        }
        return Image(canvas.image, canvas.depth if with_depth else None)

    def _draw_piece(
        self,
        piece: Piece,
        splats: SplatList,
        canvas: "Canvas",
        team: ThreadTeam,
    ) -> int:
        """Draw a projected piece of a list; give the fragments."""
        tiles, projected = self._tiles, self._splats
        records = projected.records.reshape(-1)
        turns = np.zeros(1, np.int64)

        def draw(_: int) -> int:
            scratch = self._scratch(len(projected.entries))
            return self._kernels.draw_tiles(
                records,
                projected.boxes,
                projected.entries,
                projected.visible,
                turns,
                splats.mode is SplatMode.POINTS,
                np.float32(self._least_light),
                splats.sheets,
                canvas.limit_mm,
                tiles.fresh,
                piece.last,
                scratch.items,
                scratch.limits,
                scratch.sums,
                scratch.sheets,
                scratch.far,
                tiles.states,
                tiles.depths,
                tiles.alive,
                tiles.drawn,
                canvas.image,
                canvas.depth,
            )

        return sum(team.map(draw, range(team.threads)))

    def _scratch(self, splats: int) -> TileScratch:
        scratch: TileScratch | None = getattr(self._local, "scratch", None)
        if scratch is None or scratch.items.shape[1] < splats:
            scratch = self._local.scratch = TileScratch(splats)
        return scratch
