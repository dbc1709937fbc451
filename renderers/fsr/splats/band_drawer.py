"""Lists of splats composited into a band of a picture."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from renderers.fsr.kernels.bin_splats import FRAGMENT_BITS
from renderers.fsr.kernels.cull_and_draw import cull_and_draw
from renderers.fsr.kernels.draw_pass import draw_list
from renderers.fsr.kernels.tile_buffer import Canvas
from renderers.fsr.splats.set_view import SetView, Traversal
from renderers.fsr.splats.splat_buffers import (
    begin_picture,
    make_splat_buffers,
    make_tile_buffer,
)
from renderers.fsr.splats.splat_list import SplatList, culling_of, list_splats


class BandCost(NamedTuple):
    """What a band of a picture took.

    listed, spans: elements that culling left, and rows that hold any. subdivided:
    splats too near. visible: splats that showed. fragments: in parts of 2 **
    `FRAGMENT_BITS`.
    """

    listed: int
    spans: int
    subdivided: int
    visible: int
    fragments: int


def count_up(costs: Sequence[BandCost], rows: int) -> dict[str, int]:
    """Add up; what several bands listed or drew counts for each. rows: of the set."""
    rows *= len(costs)
    return {
        "listed": sum(cost.listed for cost in costs),
        "visible": sum(cost.visible for cost in costs),
        "subdivided": max(cost.subdivided for cost in costs),
        "rows": rows,
        "culled rows": rows - sum(cost.spans for cost in costs),
        "fragments": sum(cost.fragments for cost in costs) >> FRAGMENT_BITS,
    }


class BandDrawer:
    """Draw one band at a time, in memory that is kept from picture to picture."""

    def __init__(self) -> None:
        self._most = 0
        self._buffers = make_splat_buffers(0)
        self._shape = 1, 1, False
        self._tiles = make_tile_buffer(*self._shape)

    def draw(self, splats: SplatList, canvas: Canvas) -> BandCost:
        """Composite a list into its band of the picture."""
        set_view, culled = splats.set_view, splats.culled
        needed = max(culled.listed, len(culled.near_keys))
        self._begin(set_view, splats.band, needed, len(canvas.depth) > 0)
        visible, fragments = draw_list(
            culled,
            splats.order,
            set_view.shaded.splats,
            set_view.shaded.rows,
            set_view.view,
            set_view.style,
            self._buffers,
            self._tiles,
            canvas,
        )
        return BandCost(
            culled.listed, len(culled.spans), culled.subdivided, visible, fragments
        )

    def cull_and_draw(
        self,
        set_view: SetView,
        band: range,
        planes: NDArray[np.float32],
        canvas: Canvas,
    ) -> BandCost:
        """Do both stages of a band; planes: see `SetView.planes_of`."""
        if set_view.traversal is Traversal.GRID:
            # rows are put in order in between
            return self.draw(list_splats(set_view, band, planes), canvas)
        needed = self._most
        while True:
            self._begin(set_view, band, needed, len(canvas.depth) > 0)
            *cost, needed = cull_and_draw(
                set_view.shaded.rows,
                set_view.shaded.splats,
                set_view.view,
                planes,
                culling_of(set_view),
                set_view.style,
                self._buffers,
                self._most,
                self._tiles,
                canvas,
            )
            if needed <= self._most:
                return BandCost(*cost)

    def _begin(
        self, set_view: SetView, band: range, needed: int, with_depth: bool
    ) -> None:
        if self._most < needed:
            # views of one set differ less than this
            self._most = max(needed, min(2 * needed, len(set_view.shaded)))
            self._buffers = make_splat_buffers(self._most)
        shape = (*set_view.tiles, with_depth)
        if self._shape != shape:
            self._shape = shape
            self._tiles = make_tile_buffer(*shape)
        begin_picture(self._tiles, band)
