"""Lists composited into the strips of a picture."""

import math
import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from renderers.fsr.classic.kernel_set import KernelSet
from renderers.fsr.classic.mode import SplatMode
from renderers.fsr.classic.near import LAST_SIGMA
from renderers.fsr.classic.picture_cost import STAGES, StripCost
from renderers.fsr.classic.projection.kernels import CUT
from renderers.fsr.classic.scratch import SplatRoom, TileScratch, TileStates
from renderers.fsr.classic.set_view import sigma_of
from renderers.fsr.classic.splat_list import SplatList

_EDGE = math.exp(-0.5 * CUT**2)
FOOTPRINT_SUM = 2 * math.pi * (1 - _EDGE * (1 + 0.5 * CUT**2)) / (1 - _EDGE)
"""Integral of the edge-subtracted footprint, in squared sigmas."""


@dataclass(frozen=True, slots=True)
class Canvas:
    """Hold a picture being drawn; depth and limits without elements are not wanted.

    least_light: below which a square of pixels takes no more.
    """

    image: NDArray[np.float32]
    depth: NDArray[np.float32]
    limit_mm: NDArray[np.float32]
    least_light: float


class StripDrawer:
    """Draw one strip at a time, in memory that is kept from picture to picture."""

    def __init__(self, kernels: KernelSet) -> None:
        self._kernels = kernels
        self._room = SplatRoom(0)
        self._scratch = TileScratch(0)
        self._tiles = TileStates(1, 1, False)

    def draw(self, splats: SplatList, canvas: Canvas) -> StripCost:
        """Composite a list into its strip of the picture."""
        began = time.perf_counter()
        seen = splats.seen
        painted, camera, view, mode = seen.painted, seen.camera, seen.view, seen.mode
        self._make_room(splats, len(canvas.depth) > 0)
        spent = np.zeros(len(STAGES), np.int64)
        visible, fragments = self._kernels.draw_pieces(
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
            (
                view.base,
                view.matrix,
                int(camera.projection),
                np.float32(view.scale),
                camera.width,
                camera.height,
            ),
            (
                np.float32(sigma_of(mode)),
                np.float32(LAST_SIGMA**2),
                mode is SplatMode.POINTS,
                np.float32(FOOTPRINT_SUM if mode is SplatMode.SHEET else 0.0),
                np.float32(CUT * sigma_of(mode) * painted.widest_mm),
            ),
            self._room.all_,
            self._tiles.all_,
            self._scratch.all_,
            (
                canvas.image,
                canvas.depth,
                canvas.limit_mm,
                np.float32(canvas.least_light),
                seen.sheets,
            ),
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

    def _make_room(self, splats: SplatList, with_depth: bool) -> None:
        wanted = max(splats.count, len(splats.near_places))
        if self._room.splats < wanted:
            # views of one set differ less than this
            wanted = max(wanted, min(2 * wanted, len(splats.seen.painted.rows)))
            self._room = SplatRoom(wanted)
            self._scratch = TileScratch(wanted)
        shape = (*splats.seen.tiles, with_depth)
        if self._tiles.shape != shape:
            self._tiles = TileStates(*shape)
        self._tiles.begin(splats.strip)
