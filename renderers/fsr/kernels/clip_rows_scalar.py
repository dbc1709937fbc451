"""A set's rows clipped against a view, and how far away what is left of them is.

Rows are clipped in steps of the grid from a point near the eye: planes are affine in
the column there, and a row is one interval.
"""

import math
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.fsr.kernels.depth_slabs_scalar import depth_of, key_of
from renderers.fsr.kernels.depth_sort_scalar import KEYS

F32 = NDArray[np.float32]
I32 = NDArray[np.int32]
U16 = NDArray[np.uint16]
I64 = NDArray[np.int64]
Real = float | np.float32

BINS = 64
"""Steps of depth in which a survey counts elements."""

SLACK_MM = np.float32(1e-2)
"""More than a row's bounds, made of other sums, can be off."""

SLACK = np.float32(1e-2)
"""Grid steps by which clipped rows are longer: more than rounding takes away."""

SOME = 256
"""Rows clipped and then surveyed at a time: what passes between stays in the cache."""

BESIDE = 4
"""Counts kept beside one another: spans in a row fall into one bin, and would wait."""

LEVEL = np.float32(1e-9)
"""A plane whose distance changes less than this (mm) from column to column."""

_ZERO = np.float32(0)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def first_from(columns: U16, first: int, end: int, least: Real) -> Any:
    """Find the first of a row's elements whose column is not below `least`."""
    while first < end:
        middle = (first + end) >> 1
        if columns[middle] < least:
            first = middle + 1
        else:
            end = middle
    return first


@njit(cache=True, nogil=True, error_model="numpy")
def clip_rows(
    rows: Any, first_row: int, end_row: int, base: F32, planes: F32, kept: int,
    spans: I32, ends: F32,
) -> int:  # fmt: skip
    """Clip some rows against planes; list what is left of them; give how many are.

    rows: numbers, ``(n,)`` the rows that hold any element; starts, ``(n + 1,)`` the
    first element of each, and one more than there are; places, ``(4, n)`` their j, k,
    first and last column; columns of the elements, with 32 to spare, the others but
    numbers with sixteen. Small numbers: to read them from far memory takes a good part
    of the time. base: the point
    steps are counted from. planes: ``(p, 4)``, a place is inside where ``a i + b j + c
    k + d >= 0`` for all, in steps from there. kept: spans that are listed already.
    spans: ``(n, 3)`` row, first and last + 1 element; sixteen to spare. ends: ``(4,
    SOME)`` steps from there to their first and last element, and along j and k, of
    those listed by this call; with sixteen to spare.
    """
    numbers, starts, places, columns = rows
    listed = kept
    for row in range(first_row, end_row):
        dy = np.float32(places[0, row]) - base[1]
        dz = np.float32(places[1, row]) - base[2]
        left = np.float32(places[2, row]) - base[0]
        right = np.float32(places[3, row]) - base[0]
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
        first, end = starts[row], starts[row + 1]
        if not (low <= left and high >= right):
            first = first_from(columns, first, end, math.ceil(low + base[0]))
            end = first_from(columns, first, end, math.floor(high + base[0]) + 1)
            if first == end:
                continue
            left = np.float32(columns[first]) - base[0]
            right = np.float32(columns[end - 1]) - base[0]
        at = kept - listed
        ends[0, at] = left
        ends[1, at] = right
        ends[2, at] = dy
        ends[3, at] = dz
        spans[kept, 0] = numbers[row]
        spans[kept, 1] = first
        spans[kept, 2] = end
        kept += 1
    return kept


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def square_of(x: Any, y: Any, z: Any, dx: Any, m: F32) -> Any:
    """Give squared distances from the eye, so far along rows from x, y, z.

    Of numbers, or of vectors lane by lane.
    """
    x, y, z = x + dx * m[0, 0], y + dx * m[1, 0], z + dx * m[2, 0]
    return x * x + y * y + z * z


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _row_bounds(
    first: Real, last: Real, dy: Real, dz: Real, m: F32, flat: bool, to_foot: Real
) -> tuple[Any, Any]:
    """Bound the depths of a row between two steps from the base along it.

    to_foot: of `step_to_foot`.
    """
    z = dy * m[2, 1] + dz * m[2, 2] + m[2, 3]
    if flat:
        a, b = z + first * m[2, 0], z + last * m[2, 0]
        return min(a, b) - SLACK_MM, max(a, b) + SLACK_MM
    x = dy * m[0, 1] + dz * m[0, 2] + m[0, 3]
    y = dy * m[1, 1] + dz * m[1, 2] + m[1, 3]
    a = square_of(x, y, z, first, m)
    b = square_of(x, y, z, last, m)
    near = min(a, b)
    foot = (x * m[0, 0] + y * m[1, 0] + z * m[2, 0]) * to_foot
    if first < foot < last:
        near = square_of(x, y, z, foot, m)
    return np.sqrt(near) - SLACK_MM, np.sqrt(max(a, b)) + SLACK_MM


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def step_to_foot(m: F32) -> Any:
    """Give what turns a slope towards the eye into steps to a row's nearest point."""
    square = _ZERO
    for c in range(3):
        square += m[c, 0] * m[c, 0]
    return np.float32(-1) / square


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def list_near(
    columns: U16, first: int, end: int, dy: Real, dz: Real, base: F32, m: F32,
    flat: bool, near_mm: Real, near: I32, nears: int,
) -> int:  # fmt: skip
    """Add a row's elements nearer than `near_mm` to those listed."""
    for s in range(first, end):
        if depth_of(np.float32(columns[s]) - base[0], dy, dz, m, flat) < near_mm:
            near[nears] = s
            nears += 1
    return nears


@njit(cache=True, nogil=True, error_model="numpy")
def survey_spans(
    spans: I32, first_span: int, end_span: int, ends: F32, columns: U16, eye: Any,
    lowest: U16, highest: U16, bins: I64, near: I32, nears: int,
) -> int:  # fmt: skip
    """Bound the depths of spans, count their elements by depth, list the near ones.

    spans: see `clip_rows`; ends: of those asked for. columns: of the set's elements.
    eye: base and matrix (see `project_splats`); is_flat, whether depth
    is along the view axis; low and scale, which map it to keys; near_mm. lowest,
    highest: ``(k,)`` keys, with sixteen to spare. bins: counts by the middles of rows,
    ``(BESIDE, BINS)``, which together are of all keys; added to. near: room for the
    elements nearer than `near_mm`, of which there are `nears`. Returns how many there
    are then.
    """
    base, matrix, flat, low, scale, near_mm = eye
    to_foot = step_to_foot(matrix)
    per_bin = np.float32(BINS / KEYS)
    for span in range(first_span, end_span):
        at = span - first_span
        a, b, dy, dz = ends[0, at], ends[1, at], ends[2, at], ends[3, at]
        shortest, longest = _row_bounds(a, b, dy, dz, matrix, flat, to_foot)
        lowest[span] = int(key_of(shortest, low, scale))
        highest[span] = int(key_of(longest, low, scale))
        middle = np.float32(0.5) * (shortest + longest)
        of_span = spans[span, 2] - spans[span, 1]
        bins[0, int(key_of(middle, low, scale) * per_bin)] += of_span
        if shortest < near_mm:
            nears = list_near(
                columns, spans[span, 1], spans[span, 2], dy, dz, base, matrix, flat,
                near_mm, near, nears,
            )  # fmt: skip
    return nears
