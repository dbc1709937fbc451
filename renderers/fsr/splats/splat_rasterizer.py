"""A fuzzy set drawn the 1995 way: shaded splats, one over the other.

Two stages that may run at the same time for two pictures, as in 1995: splats are
culled by rows; then taken shell by shell, projected, put in order and composited near
to far in tiles, so that a tile is done when no light is left. Each thread does both for
a strip of the picture.
"""

import time
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from renderers.fsr.fuzzy_set import FuzzySet
from renderers.fsr.splats.band_drawer import Canvas, StripDrawer
from renderers.fsr.splats.picture_cost import PictureCost, StripCost
from renderers.fsr.splats.screen_bands import Strips
from renderers.fsr.splats.set_view import see_set
from renderers.fsr.splats.shaded_set import PaintedSet
from renderers.fsr.splats.splat_list import SplatList, list_splats
from renderers.fsr.splats.splat_mode import SplatMode, Traversal
from renderers.lanes.self_check import demand_vectors
from renderers.scene import Camera, Image, Scene
from renderers.scene.thread_team import LOOKS, ThreadTeam

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
        least_light: float = LEAST_LIGHT,
    ) -> None:
        demand_vectors("Drawing splats")
        self._painted = PaintedSet(fuzzy_set, scene)
        self._row_count = fuzzy_set.rows.row_count
        self._least_light = least_light
        self._strips = Strips()
        self._drawers: list[StripDrawer] = []
        self._cost: PictureCost | None = None

    @property
    def counters(self) -> dict[str, int]:
        """Get what the last picture took, see `PictureCost`."""
        return self._cost.counters() if self._cost else {}

    @property
    def stage_s(self) -> dict[str, float]:
        """Get the last picture's seconds by stage, see `PictureCost`."""
        return self._cost.stage_s() if self._cost else {}

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
        seen = see_set(self._painted, camera, mode, traversal)
        team.rouse()
        strips = self._strips.cut(*seen.tiles, team.threads)
        # what Python does is done before there are two threads of it
        planes = [seen.planes_of(strip) for strip in strips]
        nobody = np.zeros(1, np.int64)

        def draw(drawer: StripDrawer, number: int) -> StripCost:
            # the first strip's thread calls the others
            others = (
                (team.bell, team.busy, LOOKS) if number == 0 else (nobody, nobody, 0)
            )
            return drawer.cull_and_draw(
                seen, strips[number], planes[number], canvas, others
            )

        view_s = time.perf_counter() - began
        canvas = self._canvas(camera, with_depth, limit_mm)
        rings = traversal is Traversal.DISTANCE
        return self._draw(draw, strips, canvas, team, view_s, rings=rings)

    def prepare(
        self,
        camera: Camera,
        mode: SplatMode,
        traversal: Traversal = Traversal.DISTANCE,
        *,
        threads: int = 1,
    ) -> tuple[SplatList, ...]:
        """Cull one view: the first stage. It may run while another view is drawn.

        threads: that are to draw it. Gives a list for each.
        """
        seen = see_set(self._painted, camera, mode, traversal)
        strips = self._strips.cut(*seen.tiles, threads)
        return tuple(list_splats(seen, strip) for strip in strips)

    def draw_list(
        self,
        lists: Sequence[SplatList],
        team: ThreadTeam,
        *,
        with_depth: bool = False,
        limit_mm: NDArray[np.float32] | None = None,
    ) -> Image:
        """Composite what is prepared: the second stage.

        Bits do not depend on the number of threads. with_depth: find for every pixel
        the depth by which half of the light is gone, along the ray, or along the axis
        in an orthographic view. limit_mm: ``(h, w)`` depth of something opaque,
        infinite where there is nothing; splats behind it are hidden per pixel. Raises
        ValueError where limits do not fit the camera.
        """
        canvas = self._canvas(lists[0].seen.camera, with_depth, limit_mm)
        strips = [splats.strip for splats in lists]

        def draw(drawer: StripDrawer, number: int) -> StripCost:
            return drawer.draw(lists[number], canvas)

        return self._draw(draw, strips, canvas, team)

    def _canvas(
        self,
        camera: Camera,
        with_depth: bool,
        limit_mm: NDArray[np.float32] | None,
    ) -> Canvas:
        size = camera.height, camera.width
        if limit_mm is not None and limit_mm.shape != size:
            raise ValueError(
                f"depth limits of shape {limit_mm.shape} do not fit a picture of "
                f"{size[0]} x {size[1]}"
            )
        return Canvas(
            np.empty((*size, 4), np.float32),
            np.empty(size if with_depth else (0, 0), np.float32),
            np.empty((0, 0), np.float32) if limit_mm is None else limit_mm,
            self._least_light,
        )

    def _draw(
        self,
        draw: Callable[[StripDrawer, int], StripCost],
        strips: Sequence[range],
        canvas: Canvas,
        team: ThreadTeam,
        view_s: float | None = None,
        *,
        rings: bool = False,
    ) -> Image:
        """Draw all strips.

        draw: one of them, with nobody else's memory. view_s: that setting the view up
        took; None where culling was done before. rings: see `ThreadTeam.map`.
        """
        while len(self._drawers) < len(strips):
            self._drawers.append(StripDrawer())

        began = time.perf_counter()

        def work(number: int) -> tuple[StripCost, float]:
            cost = draw(self._drawers[number], number)
            # with what it takes until a thread begins
            return cost, time.perf_counter() - began - cost.waited_s

        drawn = team.map(work, range(len(strips)), rings=rings)
        costs, until = zip(*drawn, strict=True)
        self._strips.learn(strips, until)
        self._cost = PictureCost(costs, self._row_count, view_s)
        return Image(canvas.image, canvas.depth if canvas.depth.size else None)
