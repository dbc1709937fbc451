"""Splats put in order by counting, first by distance, then by tile.

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
def bin_splats(
    ranges: I32, parts: I64, alive: I64, across: int, start: I64, items: I32
) -> int:
    """List the numbers of splats per tile, order kept; finished tiles get none.

    ranges: first and last tile column and row, a byte each from the lowest. parts:
    ``(p, 2)``, first and last + 1 of the splats of each part. start: room for tiles +
    2; the items of tile t are then ``start[t] : start[t + 1]``. Returns the entries;
    where they exceed `items`, nothing was written and the caller makes room.
    """
    tiles = alive.shape[0]
    start[:] = 0
    for part in range(parts.shape[0]):
        for s in range(parts[part, 0], parts[part, 1]):
            r = ranges[s]
            for b in range(r >> 16 & 255, (r >> 24 & 255) + 1):
                for a in range(r & 255, (r >> 8 & 255) + 1):
                    t = b * across + a
                    if alive[t] != 0:
                        start[t + 2] += 1
    for t in range(tiles):
        start[t + 2] += start[t + 1]
    entries = start[tiles + 1]
    if entries > items.shape[0]:
        return int(entries)
    for part in range(parts.shape[0]):
        for s in range(parts[part, 0], parts[part, 1]):
            r = ranges[s]
            for b in range(r >> 16 & 255, (r >> 24 & 255) + 1):
                for a in range(r & 255, (r >> 8 & 255) + 1):
                    t = b * across + a
                    if alive[t] != 0:
                        items[start[t + 1]] = s
                        start[t + 1] += 1
    return int(entries)
