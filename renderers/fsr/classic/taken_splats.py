"""The shells of a list, one after the other, near splats first."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

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
    them, first_key to end_key - 1; ties as they are. starts: where each part begins in
    both; `SPARE` behind it are its own. taken, cuts, spans: see `project_piece`. sized:
    not all are of size one. last: no more will come.
    """

    index: NDArray[np.int32]
    keys: NDArray[np.int32]
    first_key: int
    end_key: int
    starts: NDArray[np.int64]
    taken: NDArray[np.int64]
    cuts: NDArray[np.int64]
    spans: tuple[Any, ...]
    places: NDArray[np.float32]
    paints: NDArray[np.float32]
    sized: bool
    last: bool

    @property
    def parts(self) -> int:
        """Get the number of parts."""
        return len(self.taken)


class TakenSplats:
    """Take lists apart, in memory of its own."""

    def __init__(self, painted: PaintedSet) -> None:
        self._painted = painted
        room = len(painted.rows) + SPARE * (MOST_PARTS + 1)
        self._index, self._keys = np.zeros((2, room), np.int32)

    def pieces(self, splats: SplatList, tiles: TileStates) -> Iterator[Piece]:
        """Give a list's splats piece by piece; a piece holds until the next is taken.

        tiles: how those before have left them. What no tile waits for is left out.
        """
        near, painted = splats.near, self._painted
        number = np.arange(len(near.places), dtype=np.int32)
        yield _in_order(number, near.places, near.paints, True, splats.count == 0)
        if splats.count == 0:
            return
        if splats.traversal is Traversal.GRID:
            index = self._grid_order(splats)
            yield _in_order(index, painted.places, painted.paints, False, True)
            return
        count = min(-(-splats.count // LEAST_PART), MOST_PARTS)
        at = np.arange(count) * splats.count // count
        cuts = np.append(np.searchsorted(splats.begins, at), len(splats.spans))
        first = 0
        for end in splats.ends:
            waiting = np.empty(0, np.int32)
            if first > 0 or len(number) > 0:
                waiting = tiles.waiting_sets()
            yield self._shell(splats, cuts, first, end, waiting)
            first = end

    def _shell(
        self,
        splats: SplatList,
        cuts: NDArray[np.int64],
        first: int,
        end: int,
        waiting: NDArray[np.int32],
    ) -> Piece:
        """Take what is between two keys, of the spans between cuts."""
        painted, view = self._painted, splats.view
        count = len(cuts) - 1
        spans = (
            splats.spans,
            splats.lowest,
            splats.highest,
            painted.rows.shape[1],
            painted.columns,
            np.float32(view.low),
            np.float32(view.keys_per_mm),
            np.float32(splats.near_mm),
            np.float32(CUT * sigma_of(splats.mode) * painted.widest_mm),
            waiting,
        )
        return Piece(
            self._index,
            self._keys,
            first,
            end,
            splats.begins[cuts[:-1]] + SPARE * np.arange(count),
            np.zeros(count, np.int64),
            cuts,
            spans,
            painted.places,
            painted.paints,
            False,
            end == KEYS,
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
    sized: bool,
    last: bool,
) -> Piece:
    """Name splats that need no other order."""
    count = -(-len(index) // LEAST_PART)
    stride = LEAST_PART + SPARE
    parts: NDArray[np.int32] = np.zeros((count, stride), np.int32)
    for part in range(count):
        some = index[part * LEAST_PART : (part + 1) * LEAST_PART]
        parts[part, : len(some)] = some
    flat = parts.reshape(-1)
    starts = stride * np.arange(count)
    taken = np.minimum(len(index) - LEAST_PART * np.arange(count), LEAST_PART)
    none = np.empty(0, np.int32)
    nothing = np.float32(0)
    spans = (
        np.empty((0, 3), np.int32),
        none,
        none,
        1,
        np.empty(0, np.float32),
        *(nothing,) * 4,
        none,
    )
    keys = np.zeros_like(flat)
    cuts = np.empty(0, np.int64)
    return Piece(
        flat, keys, 0, 1, starts, taken, cuts, spans, places, paints, sized, last
    )
