"""What one view needs of a set: the first of two stages.

Whole rows are clipped against the view. What is left of them is cut into shells of
distance: when one is drawn it is known which tiles need nothing of the next, and its
splats there need not even be listed.
"""

import math
from bisect import bisect_left
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from renderers.fsr.classic.kernel_set import KernelSet
from renderers.fsr.classic.mode import Traversal
from renderers.fsr.classic.near import NearSplats, split_near
from renderers.fsr.classic.ordering.kernels import KEYS
from renderers.fsr.classic.set_view import SetView
from renderers.fsr.classic.survey.kernels import BINS
from renderers.fsr.classic.view import View
from renderers.fsr.culling.kernels import list_spans
from renderers.fsr.display_list import eye_voxel

SHARES = (1 / 16, 1 / 6, 1 / 2)
"""Of the elements, after which to look which tiles are finished."""

MANY = 1 << 17
"""Elements from which on it pays to look twice as often, see `_shares_for`."""

ACROSS = 0.25
"""Cosine between rows and the view's axis below which a row meets few shells."""

_SPARE = 16
"""Spans behind the last, which vectors may write to."""

LEAST_SHELL = 1 << 13
"""Fewer elements take less time than looking at the tiles."""


@dataclass(frozen=True, slots=True)
class SplatList:
    """Hold what a strip of a view leaves of a set.

    spans: ``(k, 3)`` int32, see `ClippedRows`. lowest, highest: ``(k,)`` int32, the
    keys that bound each. begins: elements in the spans before each, and in all. near:
    splats nearer than the view's `near_mm`; they are in the spans, too. shells:
    ``(m,)`` int64, last + 1 key of each; empty where `given`, ``(n,)`` int32, names the
    other elements in the order to draw them in. strip: the tiles that this is for.
    """

    seen: SetView
    spans: NDArray[np.int32]
    lowest: NDArray[np.int32]
    highest: NDArray[np.int32]
    begins: NDArray[np.int64]
    near: NearSplats
    shells: NDArray[np.int64]
    given: NDArray[np.int32]
    strip: range

    @property
    def count(self) -> int:
        """Get the number of elements in the spans."""
        return int(self.begins[-1])


def list_splats(
    seen: SetView,
    kernels: KernelSet,
    strip: range,
    planes: NDArray[np.float32] | None = None,
) -> SplatList:
    """Cull a set for a strip of a view's tiles, and cut it into shells.

    planes: see `SetView.planes_of`, where these are known already.
    """
    painted, view, near_mm = seen.painted, seen.view, seen.near_mm
    count = len(painted.row_numbers)
    spans = np.empty((count, 3), np.int32)
    ends = np.empty((4, count + _SPARE), np.float32)
    begins = np.empty(count + 1, np.int64)
    kept = kernels.clip_set(
        painted.row_numbers,
        painted.row_extents,
        painted.row_places,
        painted.columns,
        view.base,
        seen.planes_of(strip) if planes is None else planes,
        spans,
        ends,
        begins,
    )
    spans, begins = spans[:kept], begins[: kept + 1]
    lowest, highest = np.empty((2, kept + _SPARE), np.int32)
    bins = np.empty(BINS, np.int64)
    near = np.empty(begins[-1] if near_mm > view.low else 0, np.int32)
    nears = kernels.survey_spans(
        spans,
        ends,
        painted.columns,
        view.base,
        view.matrix,
        view.is_flat,
        np.float32(view.low),
        np.float32(view.keys_per_mm),
        np.float32(near_mm if near_mm > view.low else -math.inf),
        lowest,
        highest,
        bins,
        near,
    )
    given, shells = np.empty(0, np.int32), np.empty(0, np.int64)
    if seen.traversal is Traversal.GRID:
        given = _grid_order(seen, spans)
    elif kept:
        shells = _shell_ends(bins, seen.sheets, _shares_for(view, int(begins[-1])))
    return SplatList(
        seen,
        spans,
        lowest,
        highest,
        begins,
        split_near(near[:nears], painted.places, painted.paints, view, seen.sigma_mm),
        shells,
        given,
        strip,
    )


def _grid_order(seen: SetView, spans: NDArray[np.int32]) -> NDArray[np.int32]:
    """List elements of spans as the grid orders them, without the near ones.

    Slices, and rows in a slice, are taken from both ends to the eye's own.
    """
    rows, view = seen.painted.rows, seen.view
    column, j, k = eye_voxel(rows, seen.camera).tolist()
    slices, lines = np.divmod(spans[:, 0], rows.shape[1])
    turns = _turn(lines, j, rows.shape[1]), _turn(slices, k, rows.shape[0])
    far_first = spans[np.lexsort(turns)]
    count = int((spans[:, 2] - spans[:, 1]).sum())
    index, row = np.empty((2, count), np.int32)
    list_spans(far_first, len(spans), rows.x, column, index, row)
    index = index[::-1]
    steps = seen.painted.places[index, :3] - view.base
    places = steps @ view.matrix[:, :3].T + view.matrix[:, 3]
    is_near = np.linalg.norm(places, axis=1) < seen.near_mm
    return np.ascontiguousarray(index[~is_near])


def _turn(index: NDArray[np.int32], eye: int, count: int) -> NDArray[np.int64]:
    """Give the step at which each of 0..count - 1 is taken, from far to near."""
    return np.where(index < eye, index, eye + count - 1 - index)


def _shares_for(view: View, count: int) -> tuple[float, ...]:
    """Give `SHARES`, with one between each two for many elements in rows across.

    A shell looks at all elements of a row that it meets. Rows across the view of an eye
    outside meet few, so that more shells cost little, and what lies behind is found to
    be hidden sooner.
    """
    row, axis = view.matrix[:, 0], view.matrix[2, 0]
    if count < MANY or view.low == 0 or abs(axis) > ACROSS * np.linalg.norm(row):
        return SHARES
    between = [math.sqrt(a * b) for a, b in pairwise((*SHARES, 1.0))]
    return tuple(sorted((*SHARES, *between)))


def _shell_ends(
    bins: NDArray[np.int64], sheets: NDArray[np.float32], shares: tuple[float, ...]
) -> NDArray[np.int64]:
    """Give keys at which shells end: between two sheets."""
    passed = np.cumsum(bins).tolist()
    every = passed[-1]
    ends: list[int] = []
    done = 0
    for share in shares:
        until = bisect_left(passed, share * every) + 1
        key = until * (KEYS // BINS)
        if len(sheets) and key < KEYS:
            number = np.floor(np.arange(KEYS, dtype=np.float32) / sheets[2])
            key = int(np.searchsorted(number, number[key]))
        inside = passed[min(until, BINS) - 1]
        if inside - done >= LEAST_SHELL and every - inside >= LEAST_SHELL:
            ends.append(key)
            done = inside
    return np.array([*ends, KEYS])
