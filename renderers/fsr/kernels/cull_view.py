"""What a screen band needs of a fuzzy set, found in one call.

Rows are clipped, the depths of what is left are bounded, splats near the eye are
subdivided, and the rest is cut into depth slabs. Two threads that did this step by step
would wait for each other's Python between the steps.
"""

import math
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.fsr.kernels.clip_rows import (
    BESIDE,
    BINS,
    SOME,
    are_within,
    clip_rows,
    find_ends,
    survey_spans,
)
from renderers.fsr.kernels.depth_sort import KEYS
from renderers.fsr.kernels.subdivide import split_splats
from renderers.fsr.splats.near_splats import NEAR_KEYS, PARTS_REACH

F64 = NDArray[np.float64]
I32 = NDArray[np.int32]
U16 = NDArray[np.uint16]
I64 = NDArray[np.int64]
Real = float | np.float32
ROOM = 1 << 12
"""Near splats that there is room for at first."""
ACROSS = 0.25
"""Cosine between rows and the view's axis below which a row meets few shells."""
SPARE = 16
"""Spans behind the last, which vectors may write to."""
F32 = NDArray[np.float32]


@njit(cache=True, nogil=True, error_model="numpy")
def nearing(eye: Any) -> Any:
    """Give an eye for `survey_spans`: one near which nothing is has no `near_mm`."""
    base, matrix, flat, low, scale, near_mm = eye
    none = np.float32(-np.inf)
    return base, matrix, flat, low, scale, near_mm if near_mm > low else none


@njit(cache=True, nogil=True, error_model="numpy")
def with_room(near: I32, nears: int, spans: I32) -> I32:
    """Give room for as many more near splats as there are in spans.

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
def split_near(near: I32, splats: Any, eye: Any, split_at: Any) -> Any:
    """Split near splats; give places, paints and keys of parts, and how many were.

    A key is a power of two times as fine as those of all splats, so that sheets end
    between keys. It does not depend on which splats are near: neither does the order.
    """
    base, matrix, flat, low, scale, near_mm = eye
    places, paints, cut, depths = split_splats(
        near, splats[0], splats[1], base, matrix, flat, split_at[0], split_at[1]
    )
    keys = np.empty(depths.shape[0], np.int32)
    fine = np.float32(1)
    reach = (near_mm * np.float32(PARTS_REACH) - low) * scale
    while reach > 0 and 2 * fine * reach <= NEAR_KEYS:
        fine *= np.float32(2)
    for part in range(depths.shape[0]):
        step = max((depths[part] - low) * scale, np.float32(0)) * fine
        keys[part] = int(min(step, np.float32(NEAR_KEYS - 1)))
    return places, paints, keys, cut


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
def shells_of(bins: I64, eye: Any, shelling: Any) -> I64:
    """Give `find_shells` for many elements in rows across the view, or else.

    A shell looks at all elements of a row that it meets. Rows across the view of an eye
    outside meet few, so that more shells cost little, and what lies behind is found to
    be hidden sooner. shelling: shares, more of them, elements that are many, and what
    `find_shells` asks.
    """
    few, more, many, least_shell, keys_per_sheet = shelling
    _, matrix, _, low, _, _ = eye
    row = math.sqrt(matrix[0, 0] ** 2 + matrix[1, 0] ** 2 + matrix[2, 0] ** 2)
    is_across = low > 0 and abs(matrix[2, 0]) <= ACROSS * row
    shares = more if is_across and bins.sum() >= many else few
    return find_shells(bins, shares, least_shell, keys_per_sheet)


@njit(cache=True, nogil=True, error_model="numpy")
def finish_list(
    spans: I32, lowest: U16, highest: U16, bins: I64, near: I32, splats: Any, eye: Any,
    split_at: Any, shelling: Any,
) -> Any:  # fmt: skip
    """Give what `list_strip` does, of rows that are clipped and surveyed."""
    places, paints, keys, cut = split_near(near, splats, eye, split_at)
    counted = bins.sum(axis=0)
    shells = shells_of(counted, eye, shelling)
    return (
        spans, lowest, highest, counted.sum(), places, paints, keys, cut,
        shells[: shells.shape[0] if spans.shape[0] > 0 else 0],
    )  # fmt: skip


@njit(cache=True, nogil=True, error_model="numpy")
def list_strip(
    rows: Any, splats: Any, eye: Any, planes: F32, split_at: Any, shelling: Any
) -> Any:
    """List what is within planes of a view, see `SplatList`.

    rows: see `clip_rows`; and ``(n, 3)`` all of them as spans, and ``(2, 3)`` their
    lowest and highest place, for those who look whether all are within. splats: places
    and paints of the set. eye: see `survey_spans`. split_at: least_mm and last, see
    `split_splats`. shelling: see `shells_of`. Returns spans, lowest, highest, elements
    in all of them, places, paints and keys of near splats, how many were split, and
    shells.
    """
    count = rows[0].shape[0]
    is_whole = are_within(rows[5], eye[0], planes)
    spans = rows[4] if is_whole else np.empty((count + SPARE, 3), np.int32)
    lowest = np.empty(count + SPARE, np.uint16)
    highest = np.empty(count + SPARE, np.uint16)
    ends = np.empty((4, SOME + SPARE), np.float32)
    bins = np.zeros((BESIDE, BINS), np.int64)
    near = np.empty(ROOM, np.int32)
    of_eye = nearing(eye)
    is_near = of_eye[5] > 0
    kept = nears = 0
    for row in range(0, count, SOME):
        listed = kept
        if is_whole:
            kept = min(row + SOME, count)
            find_ends(rows[2], row, kept, eye[0], ends)
        else:
            kept = clip_rows(
                rows[:4], row, min(row + SOME, count), eye[0], planes, kept, spans, ends
            )
        if is_near:
            near = with_room(near, nears, spans[listed:kept])
        nears = survey_spans(
            spans, listed, kept, ends, rows[3], of_eye, lowest, highest, bins,
            near, nears,
        )  # fmt: skip
    return finish_list(
        spans[:kept], lowest, highest, bins, near[:nears], splats, eye, split_at,
        shelling,
    )  # fmt: skip
