"""Splats put in order of distance by counting, and picked out for each tile.

Counting takes two passes whatever the order was before and needs no comparison.
Keys that are read from memory index as unsigned numbers: of signed ones, compiled code
asks each time whether they count from the end, which took half of the time.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

I32 = NDArray[np.int32]
I64 = NDArray[np.int64]

KEYS = 4096
"""Distances told apart by the order: of 130 mm, steps of 32 microns."""

NOWHERE = 255
"""A range of tiles that ends before it begins."""


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
def list_entries(
    entries: I64, count: int, top: int, bottom: int, first: int, last: int, items: I32,
    own: I32,
) -> int:  # fmt: skip
    """Do as `list_block` with the entries of `place_by_keys`."""
    n = 0
    for s in range(count):
        r = np.int32(entries[s] >> 32)
        beside = r & 255 > last or (r >> 8) & 255 < first
        if beside or (r >> 16) & 255 > bottom or (r >> 24) & 255 < top:
            continue
        items[n] = np.int32(entries[s] & 0xFFFFFFFF)
        own[n] = r
        n += 1
    return n


@njit(cache=True, nogil=True, error_model="numpy")
def list_block(
    ranges: I32, numbers: I32, count: int, top: int, bottom: int, first: int, last: int,
    items: I32, own: I32,
) -> int:  # fmt: skip
    """List those of `count` splats that meet any of a block of tiles.

    ranges: first and last tile column and row, a byte each from the lowest. numbers:
    what splats are listed as. top, bottom, first, last: rows and columns of the tiles.
    items, own: which splats, in their order, and their ranges. Returns their number.
    """
    n = 0
    for s in range(count):
        r = ranges[s]
        beside = r & 255 > last or (r >> 8) & 255 < first
        if beside or (r >> 16) & 255 > bottom or (r >> 24) & 255 < top:
            continue
        items[n] = numbers[s]
        own[n] = r
        n += 1
    return n


@njit(cache=True, nogil=True, error_model="numpy")
def list_tile(items: I32, own: I32, n: int, column: int, listed: I32) -> int:
    """List those of the first n splats of a row that meet its tile in a column."""
    found = 0
    for s in range(n):
        if own[s] & 255 <= column <= (own[s] >> 8) & 255:
            listed[found] = items[s]
            found += 1
    return found
