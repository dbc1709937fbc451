"""View culling: what a screen band needs of a fuzzy set, found in one call.

Rows are clipped, the depths of what is left are bounded, splats near the eye are
subdivided, and the rest is cut into depth slabs. Two threads that did this step by step
would wait for each other's Python between the steps.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from renderers.fsr.kernels.array_types import F32, F64, I32, I64, U16
from renderers.fsr.kernels.clip_rows import (
    BESIDE,
    BINS,
    SOME,
    Rows,
    bound_spans,
    clip_rows,
    find_ends,
    is_within,
)
from renderers.fsr.kernels.depth_sort import KEYS
from renderers.fsr.kernels.project_splats import Splats
from renderers.fsr.kernels.subdivide import subdivide_near
from renderers.fsr.kernels.view_planes import GridView

FIRST_NEAR = 1 << 12
"""Near splats that are allowed for at first."""
ACROSS = 0.25
"""Cosine between rows and the view's axis below which a row meets few slabs."""
SPARE = 16
"""Spans behind the last, which vectors may write to."""


class Culling(NamedTuple):
    """How a view is culled.

    subdivide_mm, last_size: see `subdivide`. shares: of the elements, after which a
    depth slab ends; more_shares: where it pays to look twice as often; many: elements
    from which on it does. least_slab: elements that slabs have at least.
    """

    subdivide_mm: np.float32
    last_size: np.float32
    shares: F64
    more_shares: F64
    many: int
    least_slab: int


class CulledSplats(NamedTuple):
    """What a band of a view leaves of a set.

    spans: ``(k, 3)`` row, first and last + 1 element. lowest, highest: ``(k,)`` the
    keys that bound each. listed: elements in the spans. near, near_keys: parts of the
    elements nearer than the view's `near_mm`, which are in the spans, too, and where in
    the order they come. subdivided: how many splats were cut. slab_ends: ``(m,)`` last
    + 1 key of each depth slab.
    """

    spans: I32
    lowest: U16
    highest: U16
    listed: int
    near: Splats
    near_keys: I32
    subdivided: int
    slab_ends: I64


@njit(cache=True, nogil=True, error_model="numpy")
def grow_near(near: I32, nears: int, spans: I32) -> I32:
    """Return memory for as many more near splats as there are in spans.

    Between the first and the last of them, since elements are numbered row by row.
    """
    need = nears
    if spans.shape[0] > 0:
        need += spans[spans.shape[0] - 1, 2] - spans[0, 1]
    if near.shape[0] >= need:
        return near
    found = np.empty(2 * need, np.int32)
    found[:nears] = near[:nears]
    return found


@njit(cache=True, nogil=True, error_model="numpy")
def cut_slabs(bins: I64, shares: F64, least_slab: int) -> I64:
    """Return the keys at which depth slabs end.

    bins: elements by depth, see `bound_spans`. shares, least_slab: see `Culling`.
    """
    every = bins.sum()
    ends = np.empty(shares.shape[0] + 1, np.int64)
    n = 0
    bin_, inside, done = 0, bins[0], 0
    for share in shares:
        while inside < share * every:
            bin_ += 1
            inside += bins[bin_]
        if inside - done >= least_slab and every - inside >= least_slab:
            ends[n] = (bin_ + 1) * (KEYS // BINS)
            n += 1
            done = inside
    ends[n] = KEYS
    return ends[: n + 1]


@njit(cache=True, nogil=True, error_model="numpy")
def choose_slabs(bins: I64, view: GridView, culling: Culling) -> I64:
    """Cut more slabs where there are many elements in rows across the view.

    A slab looks at all elements of a row that it meets. Rows across the view of an eye
    outside meet few, so that more slabs cost little, and what lies behind is found to
    be hidden sooner.
    """
    matrix = view.matrix
    row = math.sqrt(matrix[0, 0] ** 2 + matrix[1, 0] ** 2 + matrix[2, 0] ** 2)
    is_across = view.low > 0 and abs(matrix[2, 0]) <= ACROSS * row
    is_fine = is_across and bins.sum() >= culling.many
    shares = culling.more_shares if is_fine else culling.shares
    return cut_slabs(bins, shares, culling.least_slab)


@njit(cache=True, nogil=True, error_model="numpy")
def cull_view(
    rows: Rows, splats: Splats, view: GridView, planes: F32, culling: Culling
) -> CulledSplats:
    """List what is within planes of a view; planes: see `clip_rows`."""
    count = rows.numbers.shape[0]
    is_whole = is_within(rows.bounds, view.base, planes)
    spans = rows.spans if is_whole else np.empty((count + SPARE, 3), np.int32)
    lowest = np.empty(count + SPARE, np.uint16)
    highest = np.empty(count + SPARE, np.uint16)
    ends = np.empty((4, SOME + SPARE), np.float32)
    bins = np.zeros((BESIDE, BINS), np.int64)
    near = np.empty(FIRST_NEAR, np.int32)
    # where the grid begins farther away nothing is near
    near_mm = view.near_mm if view.near_mm > view.low else np.float32(-np.inf)
    kept = nears = 0
    for row in range(0, count, SOME):
        listed = kept
        if is_whole:
            kept = min(row + SOME, count)
            find_ends(rows.places, row, kept, view.base, ends)
        else:
            kept = clip_rows(
                rows, row, min(row + SOME, count), view.base, planes, kept, spans, ends
            )
        if near_mm > 0:
            near = grow_near(near, nears, spans[listed:kept])
        nears = bound_spans(
            spans, listed, kept, ends, rows.columns, view, near_mm, lowest, highest,
            bins, near, nears,
        )  # fmt: skip
    parts, keys, cut = subdivide_near(
        near[:nears], splats, view, culling.subdivide_mm, culling.last_size
    )
    counted = bins.sum(axis=0)
    slabs = choose_slabs(counted, view, culling)
    return CulledSplats(
        spans[:kept], lowest, highest, counted.sum(), parts, keys, cut,
        slabs[: slabs.shape[0] if kept > 0 else 0],
    )  # fmt: skip
