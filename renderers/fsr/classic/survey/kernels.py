"""A set's rows clipped against a view, and how far away what is left of them is.

Rows are clipped in steps of the grid from a point near the eye: planes are affine in
the column there, and a row is one interval.
"""

import math
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.fsr.classic.ordering.kernels import KEYS
from renderers.fsr.classic.shells.kernels import depth_of, key_of

F32 = NDArray[np.float32]
I32 = NDArray[np.int32]
I64 = NDArray[np.int64]
Real = float | np.float32

BINS = 64
"""Steps of depth in which a survey counts elements."""

SLACK_MM = np.float32(1e-2)
"""More than a row's bounds, made of other sums, can be off."""

SLACK = np.float32(1e-2)
"""Grid steps by which clipped rows are longer: more than rounding takes away."""

LEVEL = np.float32(1e-9)
"""A plane whose distance changes less than this (mm) from column to column."""

_ZERO = np.float32(0)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def first_from(columns: F32, first: int, end: int, least: Real) -> Any:
    """Find the first of a row's elements whose column is not below `least`."""
    while first < end:
        middle = (first + end) >> 1
        if columns[middle] < least:
            first = middle + 1
        else:
            end = middle
    return first


@njit(cache=True, nogil=True, error_model="numpy")
def clip_set(
    numbers: I32, extents: I32, places: F32, columns: F32, base: F32, planes: F32,
    spans: I32, ends: F32, begins: I64,
) -> int:  # fmt: skip
    """Clip all rows against planes; list what is left of them; give their number.

    numbers: ``(n,)`` the rows that hold any element. extents: ``(2, n)`` their first
    and last + 1 element. places: ``(4, n)`` their j, k, first and last column; `n`
    with sixteen to spare. columns: of the elements. base: the point steps are counted
    from. planes: ``(p, 4)``, a place is inside where ``a i + b j + c k + d >= 0`` for
    all, in steps from there. spans: ``(n, 3)`` row, first and last + 1 element. ends:
    ``(4, n)`` steps from there to their first and last element, and along j and k; with
    sixteen to spare. begins: elements in the spans before each, and in all.
    """
    kept = 0
    begins[0] = 0
    for row in range(numbers.shape[0]):
        dy = places[0, row] - base[1]
        dz = places[1, row] - base[2]
        left = places[2, row] - base[0]
        right = places[3, row] - base[0]
        low = left
        high = right
        outside = False
        for p in range(planes.shape[0]):
            slope = planes[p, 0]
            rest = dy * planes[p, 1] + dz * planes[p, 2] + planes[p, 3]
            if slope > LEVEL:
                low = max(low, rest * (np.float32(-1) / slope) - SLACK)
            elif slope < -LEVEL:
                high = min(high, rest * (np.float32(-1) / slope) + SLACK)
            else:
                outside = outside or not rest >= _ZERO
        if outside or not low <= high:
            continue
        first, end = extents[0, row], extents[1, row]
        if not (low <= left and high >= right):
            first = first_from(columns, first, end, math.ceil(low + base[0]))
            end = first_from(columns, first, end, math.floor(high + base[0]) + 1)
            if first == end:
                continue
            left = columns[first] - base[0]
            right = columns[end - 1] - base[0]
        ends[0, kept] = left
        ends[1, kept] = right
        ends[2, kept] = dy
        ends[3, kept] = dz
        spans[kept, 0] = numbers[row]
        spans[kept, 1] = first
        spans[kept, 2] = end
        begins[kept + 1] = begins[kept] + (end - first)
        kept += 1
    return kept


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _row_bounds(
    first: Real, last: Real, dy: Real, dz: Real, m: F32, flat: bool
) -> tuple[Any, Any]:
    """Bound the depths of a row between two steps from the base along it."""
    a = depth_of(first, dy, dz, m, flat)
    b = depth_of(last, dy, dz, m, flat)
    near = min(a, b)
    if not flat:
        along = _ZERO
        square = _ZERO
        for c in range(3):
            along += m[c, 0] * (dy * m[c, 1] + dz * m[c, 2] + m[c, 3])
            square += m[c, 0] * m[c, 0]
        foot = -along / square
        if first < foot < last:
            near = depth_of(foot, dy, dz, m, flat)
    return near - SLACK_MM, max(a, b) + SLACK_MM


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def list_near(
    columns: F32, first: int, end: int, dy: Real, dz: Real, base: F32, m: F32,
    flat: bool, near_mm: Real, near: I32, nears: int,
) -> int:  # fmt: skip
    """Add a row's elements nearer than `near_mm` to those listed."""
    for s in range(first, end):
        if depth_of(columns[s] - base[0], dy, dz, m, flat) < near_mm:
            near[nears] = s
            nears += 1
    return nears


@njit(cache=True, nogil=True, error_model="numpy")
def survey_spans(
    spans: I32, ends: F32, columns: F32, base: F32, matrix: F32, flat: bool, low: Real,
    scale: Real, near_mm: Real, lowest: I32, highest: I32, bins: I64, near: I32,
) -> int:  # fmt: skip
    """Bound the depths of spans, count their elements by depth, list the near ones.

    spans, ends: see `clip_set`. columns: of the set's elements.
    base, matrix: see `project_splats`. flat: depth is along the view axis. low, scale:
    map it to keys. lowest, highest: ``(k,)`` keys, with sixteen to spare. bins: counts
    by the middles of rows, `BINS` for all keys. near: room for the elements nearer
    than `near_mm`. Returns how many these are.
    """
    nears = 0
    bins[:] = 0
    per_bin = np.float32(BINS / KEYS)
    for span in range(spans.shape[0]):
        first, end = spans[span, 1], spans[span, 2]
        a, b, dy, dz = ends[0, span], ends[1, span], ends[2, span], ends[3, span]
        shortest, longest = _row_bounds(a, b, dy, dz, matrix, flat)
        lowest[span] = int(key_of(shortest, low, scale))
        highest[span] = int(key_of(longest, low, scale))
        middle = np.float32(0.5) * (shortest + longest)
        bins[int(key_of(middle, low, scale) * per_bin)] += end - first
        if shortest < near_mm:
            nears = list_near(
                columns, first, end, dy, dz, base, matrix, flat, near_mm, near, nears
            )
    return nears
