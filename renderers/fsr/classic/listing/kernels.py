"""What a strip of a view needs of a set, found in one call.

Rows are clipped, what is left of them is surveyed, splats near the eye are split and
put in order, and the rest is cut into shells. Two threads that did this step by step
would wait for each other's Python between the steps.
"""

import math
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.fsr.classic.ordering.kernels import KEYS
from renderers.fsr.classic.splitting.kernels import split_splats
from renderers.fsr.classic.survey.kernels import BINS, clip_set, survey_spans

F32 = NDArray[np.float32]
F64 = NDArray[np.float64]
I32 = NDArray[np.int32]
I64 = NDArray[np.int64]
Real = float | np.float32

ACROSS = 0.25
"""Cosine between rows and the view's axis below which a row meets few shells."""

SPARE = 16
"""Spans behind the last, which vectors may write to."""


@njit(cache=True, nogil=True, error_model="numpy")
def split_in_order(
    near: I32, splats: Any, base: F32, matrix: F32, flat: bool, split_at: Any
) -> Any:
    """Split near splats; give places and paints, nearest first, and how many were."""
    places, paints, cut, order = split_splats(
        near, splats[0], splats[1], base, matrix, flat, split_at[0], split_at[1]
    )
    order.sort()
    sorted_places, sorted_paints = np.empty_like(places), np.empty_like(paints)
    for s in range(order.shape[0]):
        number = order[s] & 0xFFFFFFFF
        for c in range(4):
            sorted_places[s, c] = places[number, c]
            sorted_paints[s, c] = paints[number, c]
    return sorted_places, sorted_paints, cut


@njit(cache=True, nogil=True, error_model="numpy")
def find_shells(bins: I64, shares: F64, least_shell: int, keys_per_sheet: Real) -> I64:
    """Give the keys at which shells end: between two sheets.

    bins: elements by depth, see `survey_spans`. shares: of the elements, after which to
    look which tiles are finished. least_shell: elements that shells have at least.
    keys_per_sheet: zero where there are none.
    """
    every = bins.sum()
    ends = np.empty(shares.shape[0] + 1, np.int64)
    n = 0
    bin_, inside, done = 0, bins[0], 0
    for share in shares:
        while inside < share * every:
            bin_ += 1
            inside += bins[bin_]
        key = (bin_ + 1) * (KEYS // BINS)
        if keys_per_sheet > 0 and key < KEYS:
            sheet = math.floor(np.float32(key) / keys_per_sheet)
            while math.floor(np.float32(key - 1) / keys_per_sheet) == sheet:
                key -= 1
        if inside - done >= least_shell and every - inside >= least_shell:
            ends[n] = key
            n += 1
            done = inside
    ends[n] = KEYS
    return ends[: n + 1]


@njit(cache=True, nogil=True, error_model="numpy")
def shells_of(bins: I64, matrix: F32, low: Real, shelling: Any) -> I64:
    """Give `find_shells` for many elements in rows across the view, or else.

    A shell looks at all elements of a row that it meets. Rows across the view of an eye
    outside meet few, so that more shells cost little, and what lies behind is found to
    be hidden sooner. shelling: shares, more of them, elements that are many, and what
    `find_shells` asks.
    """
    few, more, many, least_shell, keys_per_sheet = shelling
    row = math.sqrt(matrix[0, 0] ** 2 + matrix[1, 0] ** 2 + matrix[2, 0] ** 2)
    is_across = low > 0 and abs(matrix[2, 0]) <= ACROSS * row
    shares = more if is_across and bins.sum() >= many else few
    return find_shells(bins, shares, least_shell, keys_per_sheet)


@njit(cache=True, nogil=True, error_model="numpy")
def list_strip(
    rows: Any, splats: Any, eye: Any, planes: F32, split_at: Any, shelling: Any
) -> Any:
    """List what is within planes of a view, see `SplatList`.

    rows: numbers, extents and places of rows and columns of elements, see `clip_set`.
    splats: places and paints of the set. eye: base, matrix, is_flat, low, scale and
    near_mm, see `survey_spans`. split_at: least_mm and last, see `split_splats`.
    shelling: see `shells_of`. Returns spans, lowest, highest, begins, places and
    paints of near splats, how many of them are parts' wholes, and shells.
    """
    numbers, extents, places, columns = rows
    base, matrix, flat, low, scale, near_mm = eye
    count = numbers.shape[0]
    spans = np.empty((count, 3), np.int32)
    ends = np.empty((4, count + SPARE), np.float32)
    begins = np.empty(count + 1, np.int64)
    kept = clip_set(
        numbers, extents, places, columns, base, planes, spans, ends, begins
    )
    lowest = np.empty(kept + SPARE, np.int32)
    highest = np.empty(kept + SPARE, np.int32)
    bins = np.empty(BINS, np.int64)
    is_near = near_mm > low
    near = np.empty(begins[kept] if is_near else 0, np.int32)
    nears = survey_spans(
        spans[:kept], ends, columns, base, matrix, flat, low, scale,
        near_mm if is_near else np.float32(-np.inf), lowest, highest, bins, near,
    )  # fmt: skip
    near_places, near_paints, cut = split_in_order(
        near[:nears], splats, base, matrix, flat, split_at
    )
    shells = shells_of(bins, matrix, low, shelling)
    return (
        spans[:kept], lowest, highest, begins[: kept + 1], near_places, near_paints,
        cut, shells[: shells.shape[0] if kept > 0 else 0],
    )  # fmt: skip
