"""What one view needs of a set: the first of two stages.

Whole rows are clipped against the view. What is left of them is cut into shells of
distance: when one is drawn it is known which tiles need nothing of the next, and its
splats there need not even be listed.
"""

import math
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderers.fsr.display_list import eye_voxel
from renderers.fsr.kernels.cull_rows import list_spans
from renderers.fsr.kernels.cull_view import list_strip
from renderers.fsr.splats.near_splats import SPLITS, WIDEST_SIGMA
from renderers.fsr.splats.set_view import SetView
from renderers.fsr.splats.splat_mode import Traversal

SHARES = (1 / 16, 1 / 6, 1 / 2)
"""Of the elements, after which to look which tiles are finished."""

MANY = 1 << 17
"""Elements from which on it pays to look twice as often, see `shells_of`."""

LEAST_SHELL = 1 << 13
"""Fewer elements take less time than looking at the tiles."""


@dataclass(frozen=True, slots=True)
class SplatList:
    """Hold what a strip of a view leaves of a set.

    spans: ``(k, 3)`` int32, see `ClippedRows`. lowest, highest: ``(k,)`` uint16, the
    keys that bound each. count: elements in the spans.
    near_places, near_paints, near_keys: of splats nearer than the view's `near_mm`,
    smaller ones in place of those too near (see `PaintedSet`), and where in the order
    they come, ties as they are; they are in the spans, too. split: how many were
    replaced. shells: ``(m,)`` int64, last + 1 key of each; empty where `given`,
    ``(n,)`` int32, names the other elements in the order to draw them in. strip: the
    tiles that this is for.
    """

    seen: SetView
    spans: NDArray[np.int32]
    lowest: NDArray[np.uint16]
    highest: NDArray[np.uint16]
    count: int
    near_places: NDArray[np.float32]
    near_paints: NDArray[np.float32]
    near_keys: NDArray[np.int32]
    split: int
    shells: NDArray[np.int64]
    given: NDArray[np.int32]
    strip: range


def list_splats(
    seen: SetView,
    strip: range,
    planes: NDArray[np.float32] | None = None,
) -> SplatList:
    """Cull a set for a strip of a view's tiles, and cut it into shells.

    planes: see `SetView.planes_of`, where these are known already.
    """
    spans, *found, split, shells = list_strip(
        *asked_of_culling(seen, seen.planes_of(strip) if planes is None else planes)
    )
    given = np.empty(0, np.int32)
    if seen.traversal is Traversal.GRID:
        given, shells = _grid_order(seen, spans), shells[:0]
    lowest, highest, count, places, paints, keys = found
    return SplatList(
        seen,
        spans,
        lowest,
        highest,
        count,
        places,
        paints,
        keys,
        split,
        shells,
        given,
        strip,
    )


def asked_of_culling(seen: SetView, planes: NDArray[np.float32]) -> tuple[Any, ...]:
    """Give what `list_strip` takes."""
    painted, view = seen.painted, seen.view
    return (
        painted.listed,
        (painted.places, painted.paints),
        (
            view.base,
            view.matrix,
            view.is_flat,
            np.float32(view.low),
            np.float32(view.keys_per_mm),
            np.float32(seen.near_mm),
        ),
        planes,
        (np.float32(seen.sigma_mm / WIDEST_SIGMA), np.float32(0.5**SPLITS)),
        (
            *_shares(SHARES),
            MANY,
            LEAST_SHELL,
            seen.sheets[2] if len(seen.sheets) else np.float32(0),
        ),
    )


@lru_cache(maxsize=4)
def _shares(
    shares: tuple[float, ...],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Give shares, and these with one between each two."""
    between = [math.sqrt(a * b) for a, b in pairwise((*shares, 1.0))]
    return np.array(shares), np.array(sorted((*shares, *between)))


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
