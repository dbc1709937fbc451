"""A fuzzy set drawn the 1995 way: shaded splats, one over the other.

Two stages that may run at the same time for two pictures, as in 1995: splats are
culled by rows; then taken depth slab by depth slab, projected, sorted and composited
near to far in tiles, so that a tile is done when no light is left. Each thread does
both for a band of the picture.
"""

import time
from collections.abc import Callable, Generator, Iterable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor

import numpy as np
from numpy.typing import NDArray

from renderers.fsr.fuzzy_set import FuzzySet
from renderers.fsr.kernels.tile_buffer import Canvas
from renderers.fsr.splats.band_drawer import BandCost, BandDrawer, count_up
from renderers.fsr.splats.screen_bands import ScreenBands
from renderers.fsr.splats.set_view import SplatMode, Traversal, view_set
from renderers.fsr.splats.shaded_set import ShadedSet
from renderers.fsr.splats.splat_list import SplatList, list_splats
from renderers.scene import Camera, Image, Scene
from renderers.scene.thread_pool import ThreadPool
from renderers.simd.self_check import require_vectors

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
        require_vectors("Drawing splats")
        self._shaded = ShadedSet(fuzzy_set, scene)
        self._row_count = fuzzy_set.rows.row_count
        self._least_light = least_light
        self._bands = ScreenBands()
        self._drawers: list[BandDrawer] = []
        self.counters: dict[str, int] = {}
        """What the last picture took, see `count_up`."""

    def draw(
        self,
        camera: Camera,
        pool: ThreadPool,
        mode: SplatMode = SplatMode.GAUSSIAN,
        traversal: Traversal = Traversal.DISTANCE,
        *,
        with_depth: bool = False,
        limit_mm: NDArray[np.float32] | None = None,
    ) -> Image:
        """Do both stages for one view: `prepare` and `draw_list`."""
        set_view = view_set(self._shaded, camera, mode, traversal)
        pool.rouse()
        bands = self._bands.cut(*set_view.tiles, pool.threads)
        # what Python does is done before there are two threads of it
        planes = [set_view.planes_of(band) for band in bands]
        canvas = self._canvas(camera, with_depth, limit_mm)

        def draw(drawer: BandDrawer, n: int) -> BandCost:
            return drawer.cull_and_draw(set_view, bands[n], planes[n], canvas)

        return self._draw(draw, bands, canvas, pool)

    def prepare(
        self,
        camera: Camera,
        mode: SplatMode,
        traversal: Traversal = Traversal.DISTANCE,
        *,
        threads: int = 1,
    ) -> tuple[SplatList, ...]:
        """Cull one view: the first stage. It may run while another view is drawn.

        threads: that will draw it. Returns a list for each.
        """
        set_view = view_set(self._shaded, camera, mode, traversal)
        bands = self._bands.cut(*set_view.tiles, threads)
        return tuple(list_splats(set_view, band) for band in bands)

    def draw_list(
        self,
        lists: Sequence[SplatList],
        pool: ThreadPool,
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
        canvas = self._canvas(lists[0].set_view.camera, with_depth, limit_mm)

        def draw(drawer: BandDrawer, n: int) -> BandCost:
            return drawer.draw(lists[n], canvas)

        return self._draw(draw, [splats.band for splats in lists], canvas, pool)

    def film(
        self,
        views: Iterable[tuple[Camera, SplatMode]],
        pool: ThreadPool,
        traversal: Traversal = Traversal.DISTANCE,
    ) -> Generator[Image, None, None]:
        """Draw views, culling each while the one before is drawn, as in 1995.

        Compiled code holds no lock of the interpreter, so threads do where 1995 had
        processes. Pictures are those of `draw` to the bit. A view is taken one picture
        ahead.
        """
        coming = iter(views)
        with ThreadPoolExecutor(1, thread_name_prefix="culling") as culling:

            def cull() -> Future[tuple[SplatList, ...]] | None:
                if (view := next(coming, None)) is None:
                    return None
                return culling.submit(
                    self.prepare, *view, traversal, threads=pool.threads
                )

            waiting = cull()
            while waiting is not None:
                lists = waiting.result()
                waiting = cull()
                yield self.draw_list(lists, pool)

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
            np.float32(self._least_light),
        )

    def _draw(
        self,
        draw: Callable[[BandDrawer, int], BandCost],
        bands: Sequence[range],
        canvas: Canvas,
        pool: ThreadPool,
    ) -> Image:
        """Draw all bands; draw: one of them, with nobody else's memory."""
        while len(self._drawers) < len(bands):
            self._drawers.append(BandDrawer())
        began = time.perf_counter()

        def work(number: int) -> tuple[BandCost, float]:
            cost = draw(self._drawers[number], number)
            # with what it takes until a thread begins
            return cost, time.perf_counter() - began

        costs, until = zip(*pool.map(work, range(len(bands))), strict=True)
        self._bands.learn(bands, until)
        self.counters = count_up(costs, self._row_count)
        return Image(canvas.image, canvas.depth if canvas.depth.size else None)
