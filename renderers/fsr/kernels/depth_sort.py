"""Tile lists made sixteen splats at a time; the method is told in the scalar twin."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.lanes import any_, i32, lanes, load, store_packed
from renderers.lanes import count as set_bits

I32 = NDArray[np.int32]
I64 = NDArray[np.int64]

_W = 16


@njit(cache=True, nogil=True, error_model="numpy")
def list_block(
    ranges: I32, numbers: I32, count: int, top: int, bottom: int, first: int, last: int,
    items: I32, own: I32,
) -> int:  # fmt: skip
    """Do as the scalar twin; all arrays have sixteen to spare."""
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
    """Do as the scalar twin; all arrays have sixteen to spare."""
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
    """Do as the scalar twin."""
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
