"""Rows of a fuzzy set clipped against a view, sixteen at a time.

A row is one interval of columns. Planes are affine in the column, in steps of the grid
from a point near the eye, so the interval within all planes follows from one division a
plane. The depths of what is left are bounded by those of the interval's two ends.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from renderers.fsr.kernels.array_types import F32, I32, I64, U16, Lanes, Real
from renderers.fsr.kernels.depth_sort import KEYS
from renderers.fsr.kernels.view_planes import ORTHOGRAPHIC, GridView, depth_of
from renderers.simd import (
    all_,
    any_,
    bits,
    count,
    f32,
    floor,
    i32,
    lanes,
    load,
    load_where,
    maximum,
    minimum,
    select,
    sqrt,
    store,
    store_packed,
    store_triples,
)
from renderers.simd import lowest as lowest_bit

BINS = 64
"""Steps of depth in which elements are counted."""
SLACK_MM = np.float32(1e-2)
"""More than a row's bounds, made of other sums, can be off."""
SLACK = np.float32(1e-2)
"""Grid steps by which clipped rows are longer: more than rounding takes away."""
SOME = 256
"""Rows clipped and then bounded at a time: what passes between stays in the cache."""
BESIDE = 4
"""Counts kept beside one another: spans in a row fall into one bin, and would wait."""
LEVEL = np.float32(1e-9)
"""A plane whose distance changes less than this (mm) from column to column."""
ABREAST = 32
"""Columns compared at a time: most rows are not longer, and need no second time."""
_W = 16
_ALL = (1 << _W) - 1
_ZERO = np.float32(0)


class Rows(NamedTuple):
    """The rows of a set that hold any element, and the elements' columns.

    numbers: ``(n,)`` rows ``k * per_slice + j``. starts: ``(n + 1,)`` the first element
    of each, and one more than there are. places: ``(4, n)`` their j, k, first and last
    column: small numbers, since to read them from far memory takes a good part of the
    time. columns: of the elements, with 32 to spare; starts and places have sixteen.
    spans: ``(n, 3)`` row, first and last + 1 element of whole rows. bounds: ``(2, 3)``
    lowest and highest place.
    """

    numbers: I32
    starts: I32
    places: U16
    columns: U16
    spans: I32
    bounds: F32
    per_slice: int


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def square_of(x: Lanes, y: Lanes, z: Lanes, dx: Lanes, m: F32) -> Lanes:
    """Return squared distances from the eye, so far along rows from x, y, z.

    Of numbers, or of vectors lane by lane.
    """
    x, y, z = x + dx * m[0, 0], y + dx * m[1, 0], z + dx * m[2, 0]
    return x * x + y * y + z * z


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def step_to_foot(m: F32) -> Lanes:
    """Return what turns a slope towards the eye into steps to a row's nearest point."""
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
def is_within(bounds: F32, base: F32, planes: F32) -> bool:
    """True if a box lies within planes; bounds: its lowest and highest place."""
    for p in range(planes.shape[0]):
        rest = planes[p, 3]
        for c in range(3):
            one = planes[p, c] * (bounds[0, c] - base[c])
            other = planes[p, c] * (bounds[1, c] - base[c])
            rest += min(one, other)
        if not rest >= _ZERO:
            return False
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def find_ends(places: U16, first_row: int, end_row: int, base: F32, ends: F32) -> None:
    """Fill in `ends` of rows that are kept whole, see `clip_rows`."""
    stride, width = places.shape[1], ends.shape[1]
    for row in range(first_row, end_row, _W):
        at = row - first_row
        store(ends, at, f32(load(places, 2 * stride + row, _W)) - base[0])
        store(ends, width + at, f32(load(places, 3 * stride + row, _W)) - base[0])
        store(ends, 2 * width + at, f32(load(places, row, _W)) - base[1])
        store(ends, 3 * width + at, f32(load(places, stride + row, _W)) - base[2])


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _clip_row(columns: U16, first: Lanes, end: Lanes, low: Lanes, high: Lanes) -> Lanes:
    """Return first and last + 1 of a row's elements in columns low up to high.

    Rows are short: all of one is compared before a search has found its way.
    """
    below, within = np.int64(0), np.int64(0)
    for s in range(first, end, ABREAST):
        x = load(columns, s, ABREAST)
        met = lanes(ABREAST) < end - s
        below += count(met & (x < low))
        within += count(met & (x < high))
    return first + below, first + within


@njit(cache=True, nogil=True, error_model="numpy")
def clip_rows(
    rows: Rows, first_row: int, end_row: int, base: F32, planes: F32, kept: int,
    spans: I32, ends: F32,
) -> int:  # fmt: skip
    """Clip some rows against planes; list what is left; return how many spans are.

    base: the point steps are counted from. planes: ``(p, 4)``, a place is inside where
    ``a i + b j + c k + d >= 0`` for all, in steps from there. kept: spans listed
    already. spans: ``(n, 3)`` row, first and last + 1 element; sixteen to spare. ends:
    ``(4, SOME)`` steps from the base to their first and last element, and along j and
    k, of those listed by this call; with sixteen to spare.
    """
    numbers, starts = rows.numbers, rows.starts
    places, columns = rows.places, rows.columns
    listed = kept
    stride = places.shape[1]
    width = ends.shape[1]
    limits = np.empty(2 * _W, np.int32)
    found = np.empty(3 * _W, np.int32)
    found_ends = np.empty(2 * _W, np.float32)
    # once for all rows: what is stored meanwhile might be planes, for all the compiler
    # knows, and dividing takes as long as the rest
    inverse = np.float32(-1) / planes[:, 0]
    for row in range(first_row, end_row, _W):
        met = lanes(_W) < end_row - row
        dy = f32(load(places, row, _W)) - base[1]
        dz = f32(load(places, stride + row, _W)) - base[2]
        left = f32(load(places, 2 * stride + row, _W)) - base[0]
        right = f32(load(places, 3 * stride + row, _W)) - base[0]
        low = left
        high = right
        for p in range(planes.shape[0]):
            slope = planes[p, 0]
            rest = dy * planes[p, 1] + dz * planes[p, 2] + planes[p, 3]
            if slope > LEVEL:
                low = maximum(rest * inverse[p] - SLACK, low)
            elif slope < -LEVEL:
                high = minimum(rest * inverse[p] + SLACK, high)
            else:
                met &= rest >= _ZERO
        met &= low <= high
        rest_of = bits(met)
        if rest_of == 0:
            continue
        is_whole = (low <= left) & (high >= right)
        at = kept - listed
        if rest_of == _ALL and all_(is_whole):
            first_of = load(starts, row, _W)
            end_of = load(starts, row + 1, _W)
            store_triples(spans, 3 * kept, 12, load(numbers, row, _W), first_of, end_of)
            store(ends, at, left)
            store(ends, width + at, right)
            store(ends, 2 * width + at, dy)
            store(ends, 3 * width + at, dz)
            kept += _W
            continue
        store(limits, 0, i32(-floor(-(low + base[0]))))
        store(limits, _W, i32(floor(high + base[0])) + 1)
        # no elements where a row is not met
        store(found, 0, load_where(starts, row, met))
        store(found, _W, load_where(starts, row + 1, met))
        store(found_ends, 0, left)
        store(found_ends, _W, right)
        # what is cut is put in its lane, and lanes that are left side by side
        cut = rest_of & ~bits(is_whole)
        while cut != 0:
            lane = lowest_bit(cut)
            cut &= cut - np.int64(1)
            first, end = _clip_row(
                columns, np.uint32(found[lane]), np.uint32(found[_W + lane]),
                limits[lane], limits[_W + lane],
            )  # fmt: skip
            found[lane] = first
            found[_W + lane] = end
            if first < end:
                found_ends[lane] = np.float32(columns[first]) - base[0]
                found_ends[_W + lane] = np.float32(columns[end - 1]) - base[0]
        first_of = load(found, 0, _W)
        end_of = load(found, _W, _W)
        is_kept = first_of < end_of
        store_packed(ends, at, load(found_ends, 0, _W), is_kept)
        store_packed(ends, width + at, load(found_ends, _W, _W), is_kept)
        store_packed(ends, 2 * width + at, dy, is_kept)
        store_packed(ends, 3 * width + at, dz, is_kept)
        store_packed(found, 0, load_where(numbers, row, is_kept), is_kept)
        store_packed(found, _W, first_of, is_kept)
        store_packed(found, 2 * _W, end_of, is_kept)
        store_triples(
            spans, 3 * kept, 12, load(found, 0, _W), load(found, _W, _W),
            load(found, 2 * _W, _W),
        )  # fmt: skip
        kept += count(is_kept)
    return kept


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _row_bounds(
    first: Lanes, last: Lanes, dy: Lanes, dz: Lanes, m: F32, flat: bool, to_foot: Real
) -> tuple[Lanes, Lanes]:
    """Bound the depths of rows between two steps from the base along them.

    to_foot: of `step_to_foot`.
    """
    z = dy * m[2, 1] + dz * m[2, 2] + m[2, 3]
    if flat:
        a, b = z + first * m[2, 0], z + last * m[2, 0]
        shortest, longest = minimum(a, b), maximum(a, b)
    else:
        x = dy * m[0, 1] + dz * m[0, 2] + m[0, 3]
        y = dy * m[1, 1] + dz * m[1, 2] + m[1, 3]
        a = square_of(x, y, z, first, m)
        b = square_of(x, y, z, last, m)
        shortest, longest = minimum(a, b), sqrt(maximum(a, b))
        foot = (x * m[0, 0] + y * m[1, 0] + z * m[2, 0]) * to_foot
        inside = (first < foot) & (foot < last)
        if any_(inside):
            shortest = select(inside, square_of(x, y, z, foot, m), shortest)
        shortest = sqrt(shortest)
    return shortest - SLACK_MM, longest + SLACK_MM


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _key_of(depth: Lanes, low: Real, scale: Real) -> Lanes:
    step = minimum(maximum((depth - low) * scale, _ZERO), np.float32(KEYS - 1))
    return floor(step)


@njit(cache=True, nogil=True, error_model="numpy")
def bound_spans(
    spans: I32, first_span: int, end_span: int, ends: F32, columns: U16, view: GridView,
    near_mm: Real, lowest: U16, highest: U16, bins: I64, near: I32, nears: int,
) -> int:  # fmt: skip
    """Bound the depths of spans, count their elements by depth, list the near ones.

    spans, ends: see `clip_rows`. lowest, highest: ``(k,)`` keys, with sixteen to spare.
    bins: counts by the middles of rows, ``(BESIDE, BINS)``, which together are of all
    keys; added to. near: takes the elements nearer than `near_mm`, of which there are
    `nears`. Returns how many there are then.
    """
    base, m, low, scale = view.base, view.matrix, view.low, view.keys_per_mm
    flat = view.projection == ORTHOGRAPHIC
    width = ends.shape[1]
    to_foot = step_to_foot(m)
    middles = np.empty(_W, np.int32)
    flat_spans = spans.reshape(-1)
    for span in range(first_span, end_span, _W):
        at = span - first_span
        met = lanes(_W) < end_span - span
        left = load(ends, at, _W)
        right = load(ends, width + at, _W)
        dy = load(ends, 2 * width + at, _W)
        dz = load(ends, 3 * width + at, _W)
        shortest, longest = _row_bounds(left, right, dy, dz, m, flat, to_foot)
        store(lowest, span, i32(_key_of(shortest, low, scale)))
        store(highest, span, i32(_key_of(longest, low, scale)))
        middle = _key_of((shortest + longest) * np.float32(0.5), low, scale)
        store(middles, 0, i32(middle * np.float32(BINS / KEYS)))
        # unrolled where it is known how many there are: .77 of the time of all
        begin = np.uint32(3 * span)
        if end_span - span >= _W:
            for lane in range(_W):
                of_span = begin + np.uint32(3 * lane)
                elements = flat_spans[of_span + np.uint32(2)]
                elements -= flat_spans[of_span + np.uint32(1)]
                bins[lane % BESIDE, np.uint32(middles[lane])] += elements
        else:
            for lane in range(end_span - span):
                elements = spans[span + lane, 2] - spans[span + lane, 1]
                bins[lane % BESIDE, np.uint32(middles[lane])] += elements
        if any_(met & (shortest < near_mm)):
            some_near = bits(met & (shortest < near_mm))
            while some_near != 0:
                lane = lowest_bit(some_near)
                some_near &= some_near - np.int64(1)
                nears = list_near(
                    columns, spans[span + lane, 1], spans[span + lane, 2],
                    ends[2, at + lane], ends[3, at + lane], base, m, flat, near_mm,
                    near, nears,
                )  # fmt: skip
    return nears
