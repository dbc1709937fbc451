"""Splats put in order by counting, first by distance, then by tile.

Counting takes two passes whatever the order was before and needs no comparison.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

I32 = NDArray[np.int32]
I64 = NDArray[np.int64]


@njit(cache=True, nogil=True, error_model="numpy")
def order_splats(heads: I32, n: int, counts: I32, ranges: I32, numbers: I32) -> None:
    """Sort n splats by key, near ones first, by counting; ties in reverse order.

    counts: scratch of `KEYS`. ranges, numbers: tile ranges of the splats in that
    order, and which they are.
    """
    counts[:] = 0
    for s in range(n):
        counts[heads[s, 1]] += 1
    total = 0
    for key in range(counts.shape[0]):
        here = counts[key]
        counts[key] = total
        total += here
    for s in range(n - 1, -1, -1):
        key = heads[s, 1]
        at = counts[key]
        counts[key] = at + 1
        ranges[at] = heads[s, 0]
        numbers[at] = s


@njit(cache=True, nogil=True, error_model="numpy")
def bin_splats(
    ranges: I32, numbers: I32, n: int, across: int, down: int, start: I64, items: I32
) -> int:
    """List the numbers of splats per tile, order kept.

    ranges: first and last tile column and row, a byte each from the lowest. start:
    room for tiles + 2; the items of tile t are then ``start[t] : start[t + 1]``.
    Returns the entries; where they exceed `items`, nothing was written and the caller
    makes room.
    """
    tiles = across * down
    start[: tiles + 2] = 0
    for s in range(n):
        r = ranges[s]
        for b in range(r >> 16 & 255, (r >> 24 & 255) + 1):
            for a in range(r & 255, (r >> 8 & 255) + 1):
                start[b * across + a + 2] += 1
    for t in range(tiles):
        start[t + 2] += start[t + 1]
    entries = start[tiles + 1]
    if entries > items.shape[0]:
        return int(entries)
    for s in range(n):
        r = ranges[s]
        number = numbers[s]
        for b in range(r >> 16 & 255, (r >> 24 & 255) + 1):
            for a in range(r & 255, (r >> 8 & 255) + 1):
                t = b * across + a + 1
                items[start[t]] = number
                start[t] += 1
    return int(entries)
