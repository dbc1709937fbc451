"""Tile lists made sixteen splats at a time; the method is told in the scalar twin."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.simd import any_, count, lanes, load, store_packed

I32 = NDArray[np.int32]
I64 = NDArray[np.int64]

_W = 16


@njit(cache=True, nogil=True, error_model="numpy")
def list_run(
    ranges: I32, parts: I64, row: int, first: int, last: int, items: I32, own: I32
) -> int:
    """Do as the scalar twin; ranges, items and own have sixteen to spare."""
    n = 0
    row32, first32, last32 = np.int32(row), np.int32(first), np.int32(last)
    for part in range(parts.shape[0]):
        end = parts[part, 1]
        for s in range(parts[part, 0], end, _W):
            r = load(ranges, s, _W)
            met = lanes(_W) < np.int32(end - s)
            met &= ((r >> 16) & 255 <= row32) & ((r >> 24) & 255 >= row32)
            met &= (r & 255 <= last32) & ((r >> 8) & 255 >= first32)
            if any_(met):
                store_packed(items, n, lanes(_W) + np.int32(s), met)
                store_packed(own, n, r, met)
                n += count(met)
    return n


@njit(cache=True, nogil=True, error_model="numpy")
def list_tile(items: I32, own: I32, n: int, column: int, listed: I32) -> int:
    """Do as the scalar twin."""
    found = 0
    here = np.int32(column)
    for s in range(0, n, _W):
        r = load(own, s, _W)
        met = lanes(_W) < np.int32(n - s)
        met &= (r & 255 <= here) & ((r >> 8) & 255 >= here)
        if any_(met):
            store_packed(listed, found, load(items, s, _W), met)
            found += count(met)
    return found
