"""Splats sorted by depth, and listed tile by tile in that order.

A counting sort takes two passes whatever the order was before and compares nothing.
Keys read from memory index as unsigned numbers: compiled code tests signed ones each
time for counting from the end, which took half of the time.
"""

import numpy as np
from numba import njit

from renderers.fsr.kernels.array_types import I32, I64, U16
from renderers.simd import any_, i32, lanes, load, store_packed
from renderers.simd import count as set_bits

KEYS = 4096
"""Distances told apart by the order: of 130 mm, steps of 32 microns."""
NOWHERE = 255
"""A range of tiles that ends before it begins."""
_W = 16


@njit(cache=True, nogil=True, error_model="numpy")
def count_keys(ranges: I32, keys: I32, counts: I32) -> None:
    """Add the splats that show to the counts of their keys.

    ranges: see `list_block`. counts: ``(KEYS,)``.
    """
    for s in range(ranges.shape[0]):
        if ranges[s] != NOWHERE:
            counts[np.uint32(keys[s])] += 1


@njit(cache=True, nogil=True, error_model="numpy")
def begin_keys(counts: I32, first_key: int, end_key: int) -> int:
    """Turn counts into where the splats of each of these keys begin.

    Near ones first. Returns the number of all.
    """
    total = 0
    for key in range(first_key, end_key):
        here = counts[key]
        counts[key] = total
        total += here
    return total


@njit(cache=True, nogil=True, error_model="numpy")
def place_by_keys(ranges: I32, keys: I32, begins: I32, entries: I64) -> None:
    """Put splats where they belong, ties in their order.

    begins: see `begin_keys`; moved on. entries: of all, a splat's number and above
    that, from bit 32, its range: one place to write to, since hardly any is in the
    first cache.
    """
    for s in range(ranges.shape[0]):
        if ranges[s] != NOWHERE:
            key = np.uint32(keys[s])
            at = np.uint32(begins[key])
            entries[at] = np.int64(ranges[s]) << 32 | np.int64(s)
            begins[key] = np.int32(at + np.uint32(1))


@njit(cache=True, nogil=True, error_model="numpy")
def list_block(
    ranges: I32, numbers: I32, count: int, top: int, bottom: int, first: int, last: int,
    items: I32, own: I32,
) -> int:  # fmt: skip
    """List those of `count` splats that meet any of a block of tiles.

    ranges: first and last tile column and row, a byte each from the lowest. numbers:
    what splats are listed as. top, bottom, first, last: rows and columns of the tiles.
    items, own: which splats, in their order, and their ranges. Returns their number.
    All arrays have sixteen to spare.
    """
    n = 0
    top32, bottom32 = np.int32(top), np.int32(bottom)
    first32, last32 = np.int32(first), np.int32(last)
    for s in range(0, count, _W):
        r = load(ranges, s, _W)
        met = lanes(_W) < np.int32(count - s)
        met &= ((r >> 16) & 255 <= bottom32) & ((r >> 24) & 255 >= top32)
        met &= (r & 255 <= last32) & ((r >> 8) & 255 >= first32)
        if any_(met):
            store_packed(items, n, load(numbers, s, _W), met)
            store_packed(own, n, r, met)
            n += set_bits(met)
    return n


@njit(cache=True, nogil=True, error_model="numpy")
def list_entries(
    entries: I64, count: int, top: int, bottom: int, first: int, last: int, items: I32,
    own: I32,
) -> int:  # fmt: skip
    """List entries of `place_by_keys` as `list_block` lists ranges.

    All arrays have sixteen to spare.
    """
    n = 0
    top32, bottom32 = np.int32(top), np.int32(bottom)
    first32, last32 = np.int32(first), np.int32(last)
    for s in range(0, count, _W):
        both = load(entries, s, _W)
        r = i32(both >> 32)
        met = lanes(_W) < np.int32(count - s)
        met &= ((r >> 16) & 255 <= bottom32) & ((r >> 24) & 255 >= top32)
        met &= (r & 255 <= last32) & ((r >> 8) & 255 >= first32)
        if any_(met):
            store_packed(items, n, i32(both), met)
            store_packed(own, n, r, met)
            n += set_bits(met)
    return n


@njit(cache=True, nogil=True, error_model="numpy")
def list_tile(items: I32, own: I32, n: int, column: int, listed: I32) -> int:
    """List those of the first n splats of a row that meet its tile in a column."""
    found = 0
    here = np.int32(column)
    for s in range(0, n, _W):
        r = load(own, s, _W)
        met = lanes(_W) < np.int32(n - s)
        met &= (r & 255 <= here) & ((r >> 8) & 255 >= here)
        if any_(met):
            store_packed(listed, found, load(items, s, _W), met)
            found += set_bits(met)
    return found


@njit(cache=True, nogil=True, error_model="numpy")
def list_by_column(spans: I32, columns: U16, eye_column: int, index: I32) -> None:
    """List the elements of spans: each row from both ends to the eye's column."""
    n = 0
    for span in range(spans.shape[0]):
        s = spans[span, 1]
        end = spans[span, 2]
        while s < end and columns[s] < eye_column:
            index[n] = s
            n += 1
            s += 1
        t = end - 1
        while t >= s:
            index[n] = t
            n += 1
            t -= 1
