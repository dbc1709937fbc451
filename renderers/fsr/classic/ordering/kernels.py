"""Splats put in order of distance by counting, and picked out for each tile.

Counting takes two passes whatever the order was before and needs no comparison.
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
def order_by_keys(index: I32, keys: I32, parts: I64, counts: I32, ordered: I32) -> int:
    """Sort elements by key, near ones first, ties in their order; give their number.

    parts: ``(p, 2)``, first and last + 1 of the places of each part. counts: scratch
    of `KEYS`.
    """
    counts[:] = 0
    for part in range(parts.shape[0]):
        for s in range(parts[part, 0], parts[part, 1]):
            counts[keys[s]] += 1
    total = 0
    for key in range(counts.shape[0]):
        here = counts[key]
        counts[key] = total
        total += here
    for part in range(parts.shape[0]):
        for s in range(parts[part, 0], parts[part, 1]):
            key = keys[s]
            ordered[counts[key]] = index[s]
            counts[key] += 1
    return total


@njit(cache=True, nogil=True, error_model="numpy")
def list_run(
    ranges: I32, parts: I64, row: int, first: int, last: int, items: I32, own: I32
) -> int:
    """List the splats that meet any of some tiles side by side, order kept.

    ranges: first and last tile column and row, a byte each from the lowest. parts:
    ``(p, 2)``, first and last + 1 of the splats of each part. row, first, last: of the
    tiles. items, own: which splats, and their ranges. Returns their number.
    """
    n = 0
    for part in range(parts.shape[0]):
        for s in range(parts[part, 0], parts[part, 1]):
            r = ranges[s]
            beside = r & 255 > last or (r >> 8) & 255 < first
            if beside or (r >> 16) & 255 > row or (r >> 24) & 255 < row:
                continue
            items[n] = s
            own[n] = r
            n += 1
    return n


@njit(cache=True, nogil=True, error_model="numpy")
def list_tile(items: I32, own: I32, n: int, column: int, listed: I32) -> int:
    """List those of the first n splats of a run that meet its tile in a column."""
    found = 0
    for s in range(n):
        if own[s] & 255 <= column <= (own[s] >> 8) & 255:
            listed[found] = items[s]
            found += 1
    return found
