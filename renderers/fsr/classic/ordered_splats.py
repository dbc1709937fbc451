"""The shells of a list, one after the other, near splats first."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from renderers.fsr.classic.kernel_set import KernelSet
from renderers.fsr.classic.mode import Traversal
from renderers.fsr.classic.ordering.kernels import KEYS, order_by_keys
from renderers.fsr.classic.painted_set import PaintedSet
from renderers.fsr.classic.projection.kernels import CUT
from renderers.fsr.classic.scratch import TileStates
from renderers.fsr.classic.splat_list import SplatList, sigma_of
from renderers.fsr.culling.kernels import list_spans
from renderers.fsr.display_list import eye_voxel
from renderers.fsr.thread_team import ThreadTeam

SPARE = 16
"""Elements behind a list, which vectors may read."""

PART = 1 << 15
"""Elements that one thread looks at at a time."""


@dataclass(frozen=True, slots=True)
class Piece:
    """Name splats to draw, near ones first.

    index: which of `places` and `paints` (see `PaintedSet`), with `SPARE` behind.
    count: of them. last: no more will come.
    """

    index: NDArray[np.int32]
    count: int
    places: NDArray[np.float32]
    paints: NDArray[np.float32]
    last: bool


class OrderedSplats:
    """Put lists in order, in memory of its own."""

    def __init__(self, painted: PaintedSet, kernels: KernelSet) -> None:
        self._painted = painted
        self._take_shell = kernels.take_shell
        count = len(painted.rows)
        room = count + SPARE * (count // PART + 2)
        self._index, self._keys, self._ordered = np.zeros((3, room), np.int32)
        self._counts: NDArray[np.int32] = np.empty(KEYS, np.int32)

    def pieces(
        self, splats: SplatList, tiles: TileStates, team: ThreadTeam
    ) -> Iterator[Piece]:
        """Give a list's splats piece by piece; a piece holds until the next is taken.

        tiles: how those before have left them. What no tile waits for is left out.
        """
        near, painted = splats.near, self._painted
        count = len(near.places)
        number = np.arange(count + SPARE, dtype=np.int32)
        number[count:] = 0
        yield Piece(number, count, near.places, near.paints, splats.count == 0)
        if splats.count == 0:
            return
        if splats.traversal is Traversal.GRID:
            count = self._take_grid(splats)
            yield Piece(self._ordered, count, painted.places, painted.paints, True)
            return
        first = 0
        for end in splats.ends:
            waiting = np.empty(0, np.int32)
            if first > 0 or count > 0:
                waiting = tiles.waiting_sets().reshape(-1)
            count = self._take_shell_between(splats, first, end, waiting, team)
            places = painted.places, painted.paints
            yield Piece(self._ordered, count, *places, end == KEYS)
            first = end

    def _take_shell_between(
        self,
        splats: SplatList,
        first: int,
        end: int,
        waiting: NDArray[np.int32],
        team: ThreadTeam,
    ) -> int:
        painted, view, camera = self._painted, splats.view, splats.camera
        count = -(-splats.count // PART)
        cuts = np.searchsorted(splats.begins, np.arange(count) * PART)
        cuts = np.append(cuts, len(splats.spans))
        starts = splats.begins[cuts] + SPARE * np.arange(count + 1)

        def take(part: int) -> int:
            begin = starts[part]
            return self._take_shell(
                splats.spans[cuts[part] : cuts[part + 1]],
                splats.bounds[cuts[part] : cuts[part + 1]],
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

        taken = np.array(team.map(take, range(count)), np.int64)
        parts = np.stack([starts[:-1], starts[:-1] + taken], axis=-1)
        return order_by_keys(
            self._index, self._keys, parts, self._counts, self._ordered
        )

    def _take_grid(self, splats: SplatList) -> int:
        """Take elements as the grid orders them, without the near ones."""
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
        self._ordered[: len(index)] = index
        return len(index)
