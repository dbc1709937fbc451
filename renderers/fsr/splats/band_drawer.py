"""Lists composited into the strips of a picture."""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderers.fsr.kernels.cull_and_draw import list_and_draw
from renderers.fsr.kernels.draw_pass import draw_pieces
from renderers.fsr.kernels.project_splats import CUT
from renderers.fsr.splats.near_splats import LAST_SIGMA
from renderers.fsr.splats.picture_cost import StripCost
from renderers.fsr.splats.set_view import SetView, sigma_of
from renderers.fsr.splats.splat_buffers import SplatRoom, TileScratch, TileStates
from renderers.fsr.splats.splat_list import SplatList, asked_of_culling, list_splats
from renderers.fsr.splats.splat_mode import SplatMode, Traversal
from renderers.fsr.splats.splat_stages import CULL, TIMES

_EDGE = math.exp(-0.5 * CUT**2)
FOOTPRINT_SUM = 2 * math.pi * (1 - _EDGE * (1 + 0.5 * CUT**2)) / (1 - _EDGE)
"""Integral of the edge-subtracted footprint, in squared sigmas."""

Others = tuple[NDArray[np.int64], NDArray[np.int64], int]
"""What calls the threads of the other strips, and what else `list_and_draw` asks."""


@dataclass(frozen=True, slots=True)
class Canvas:
    """Hold a picture being drawn; depth and limits without elements are not wanted.

    least_light: below which a square of pixels takes no more.
    """

    image: NDArray[np.float32]
    depth: NDArray[np.float32]
    limit_mm: NDArray[np.float32]
    least_light: float


# Their arguments come in groups that several kernels share.
_draw: Callable[..., tuple[int, int]] = draw_pieces
_list_and_draw: Callable[..., tuple[int, ...]] = list_and_draw


class StripDrawer:
    """Draw one strip at a time, in memory that is kept from picture to picture."""

    def __init__(self) -> None:
        self._room = SplatRoom(0)
        self._scratch = TileScratch(0)
        self._tiles = TileStates(1, 1, False)

    def draw(self, splats: SplatList, canvas: Canvas) -> StripCost:
        """Composite a list into its strip of the picture."""
        began = time.perf_counter()
        seen = splats.seen
        painted, view = seen.painted, seen.view
        with_depth = len(canvas.depth) > 0
        self._make_room(seen, max(splats.count, len(splats.near_places)), with_depth)
        self._tiles.begin(splats.strip)
        spent = np.zeros(TIMES, np.int64)
        visible, fragments = _draw(
            (splats.near_places, splats.near_paints, splats.near_keys),
            (painted.places, painted.paints),
            painted.columns,
            painted.rows.shape[1],
            splats.given,
            (
                splats.spans,
                splats.lowest,
                splats.highest,
                np.float32(view.low),
                np.float32(view.keys_per_mm),
                np.float32(seen.near_mm),
            ),
            splats.shells,
            *_asked_of_drawing(seen),
            self._room.all_,
            self._tiles.all_,
            self._scratch.all_,
            _drawn_on(canvas, seen),
            spent,
        )
        return StripCost(
            splats.count,
            len(splats.spans),
            splats.split,
            visible,
            fragments,
            spent,
            time.perf_counter() - began,
        )

    def cull_and_draw(
        self,
        seen: SetView,
        strip: range,
        planes: NDArray[np.float32],
        canvas: Canvas,
        others: Others,
    ) -> StripCost:
        """Do both stages of a strip, see `list_and_draw`.

        planes: see `SetView.planes_of`.
        """
        began = time.perf_counter()
        if seen.traversal is Traversal.GRID:
            return self._in_order_of_grid(seen, strip, planes, canvas)
        wanted = self._room.splats
        while True:
            self._make_room(seen, wanted, len(canvas.depth) > 0)
            self._tiles.begin(strip)
            spent = np.zeros(TIMES, np.int64)
            count, spans, split, visible, fragments, wanted = _list_and_draw(
                *asked_of_culling(seen, planes),
                seen.painted.rows.shape[1],
                *_asked_of_drawing(seen),
                self._room.all_,
                self._room.splats,
                self._tiles.all_,
                self._scratch.all_,
                _drawn_on(canvas, seen),
                others,
                spent,
            )
            if wanted <= self._room.splats:
                break
        seconds = time.perf_counter() - began
        return StripCost(count, spans, split, visible, fragments, spent, seconds)

    def _in_order_of_grid(
        self,
        seen: SetView,
        strip: range,
        planes: NDArray[np.float32],
        canvas: Canvas,
    ) -> StripCost:
        """Do one stage after the other: rows are put in order in between."""
        began = time.perf_counter()
        splats = list_splats(seen, strip, planes)
        culled_s = time.perf_counter() - began
        cost = self.draw(splats, canvas)
        cost.ticks[CULL] = round(cost.ticks.sum() * culled_s / cost.seconds)
        return replace(cost, seconds=cost.seconds + culled_s)

    def _make_room(self, seen: SetView, wanted: int, with_depth: bool) -> None:
        if self._room.splats < wanted:
            # views of one set differ less than this
            wanted = max(wanted, min(2 * wanted, len(seen.painted.rows)))
            self._room = SplatRoom(wanted)
            self._scratch = TileScratch(wanted)
        shape = (*seen.tiles, with_depth)
        if self._tiles.shape != shape:
            self._tiles = TileStates(*shape)


def _asked_of_drawing(seen: SetView) -> tuple[Any, ...]:
    """Give what kernels that draw take as `seen_by` and `look`."""
    camera, view, mode = seen.camera, seen.view, seen.mode
    sigma = sigma_of(mode)
    return (
        (
            view.base,
            view.matrix,
            int(camera.projection),
            np.float32(view.scale),
            camera.width,
            camera.height,
        ),
        (
            np.float32(sigma),
            np.float32(LAST_SIGMA**2),
            mode is SplatMode.POINTS,
            np.float32(FOOTPRINT_SUM if mode is SplatMode.SHEET else 0.0),
            np.float32(CUT * sigma * seen.painted.widest_mm),
        ),
    )


def _drawn_on(canvas: Canvas, seen: SetView) -> tuple[Any, ...]:
    """Give what kernels that draw take as `canvas`."""
    return (
        canvas.image,
        canvas.depth,
        canvas.limit_mm,
        np.float32(canvas.least_light),
        seen.sheets,
    )
