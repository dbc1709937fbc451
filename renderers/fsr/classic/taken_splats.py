"""The shells of a list, one after the other, near splats first."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from renderers.fsr.classic.kernel_set import KernelSet
from renderers.fsr.classic.mode import Traversal
from renderers.fsr.classic.ordering.kernels import KEYS
from renderers.fsr.classic.painted_set import PaintedSet
from renderers.fsr.classic.projection.kernels import CUT
from renderers.fsr.classic.scratch import TileStates
from renderers.fsr.classic.splat_list import SplatList, sigma_of
from renderers.fsr.culling.kernels import list_spans
from renderers.fsr.display_list import eye_voxel

SPARE = 16
"""Elements behind a part, which vectors may write to."""

LEAST_PART = 1 << 13
"""Elements that one thread looks at at a time, at least."""

MOST_PARTS = 8
"""Parts of a list: more would take more time to hand out than they even out."""


@dataclass(frozen=True, slots=True)
class Piece:
    """Name splats to draw, in parts.

    index: which of `places` and `paints` (see `PaintedSet`). keys: by which to order
    them, first_key to end_key - 1; ties as they are. take: fills a part of both and
    gives its first and last + 1 place; `SPARE` more are its own. last: no more will
    come.
    """

    index: NDArray[np.int32]
    keys: NDArray[np.int32]
    first_key: int
    end_key: int
    parts: int
    take: Callable[[int], tuple[int, int]]
    places: NDArray[np.float32]
    paints: NDArray[np.float32]
    last: bool


class TakenSplats:
    """Take lists apart, in memory of its own."""

    def __init__(self, painted: PaintedSet, kernels: KernelSet) -> None:
        self._painted = painted
        self._take_shell = kernels.take_shell
        room = len(painted.rows) + SPARE * (MOST_PARTS + 1)
        self._index, self._keys = np.zeros((2, room), np.int32)

    def pieces(self, splats: SplatList, tiles: TileStates) -> Iterator[Piece]:
        """Give a list's splats piece by piece; a piece holds until the next is taken.

        tiles: how those before have left them. What no tile waits for is left out.
        """
        near, painted = splats.near, self._painted
        number = np.arange(len(near.places), dtype=np.int32)
        yield _in_order(number, near.places, near.paints, splats.count == 0)
        if splats.count == 0:
            return
        if splats.traversal is Traversal.GRID:
            index = self._grid_order(splats)
            yield _in_order(index, painted.places, painted.paints, True)
            return
        first = 0
        for end in splats.ends:
            waiting = np.empty(0, np.int32)
            if first > 0 or len(number) > 0:
                waiting = tiles.waiting_sets()
            yield self._shell(splats, first, end, waiting)
            first = end

    def _shell(
        self, splats: SplatList, first: int, end: int, waiting: NDArray[np.int32]
    ) -> Piece:
        """Take what is between two keys."""
        painted, view, camera = self._painted, splats.view, splats.camera
        count = min(-(-splats.count // LEAST_PART), MOST_PARTS)
        at = np.arange(count) * splats.count // count
        cuts = np.append(np.searchsorted(splats.begins, at), len(splats.spans))
        starts = splats.begins[cuts] + SPARE * np.arange(count + 1)

        def take(part: int) -> tuple[int, int]:
            begin = int(starts[part])
            taken = self._take_shell(
                splats.spans[cuts[part] : cuts[part + 1]],
                splats.lowest[cuts[part] : cuts[part + 1]],
                splats.highest[cuts[part] : cuts[part + 1]],
                painted.rows.shape[1],
                painted.columns,
                view.base,
                view.matrix,
                int(camera.projection),
                np.float32(view.low),
                np.float32(view.keys_per_mm),
                np.float32(splats.near_mm),
                first,
                end,
                np.float32(view.scale),
                np.float32(CUT * sigma_of(splats.mode) * painted.widest_mm),
                camera.width,
                camera.height,
                waiting,
                self._index[begin:],
                self._keys[begin:],
            )
            return begin, begin + taken

        all_ = painted.places, painted.paints
        return Piece(
            self._index, self._keys, first, end, count, take, *all_, end == KEYS
        )

    def _grid_order(self, splats: SplatList) -> NDArray[np.int32]:
        """List elements as the grid orders them, without the near ones."""
        rows = self._painted.rows
        index, row = np.empty((2, splats.count), np.int32)
        column = int(eye_voxel(rows, splats.camera)[0])
        list_spans(splats.spans, len(splats.spans), rows.x, column, index, row)
        index = index[::-1]
        if len(splats.near.places):
            view = splats.view
            steps = self._painted.places[index, :3] - view.base
            seen = steps @ view.matrix[:, :3].T + view.matrix[:, 3]
            index = index[~(np.linalg.norm(seen, axis=1) < splats.near_mm)]
        return index


def _in_order(
    index: NDArray[np.int32],
    places: NDArray[np.float32],
    paints: NDArray[np.float32],
    last: bool,
) -> Piece:
    """Name splats that need no other order."""
    count = -(-len(index) // LEAST_PART)
    stride = LEAST_PART + SPARE
    parts: NDArray[np.int32] = np.zeros((count, stride), np.int32)
    for part in range(count):
        some = index[part * LEAST_PART : (part + 1) * LEAST_PART]
        parts[part, : len(some)] = some

    def take(part: int) -> tuple[int, int]:
        taken = min(len(index) - part * LEAST_PART, LEAST_PART)
        return part * stride, part * stride + taken

    flat = parts.reshape(-1)
    keys = np.zeros_like(flat)
    return Piece(flat, keys, 0, 1, count, take, places, paints, last)
