"""Elements of clipped rows between two distances from the eye.

A row's own nearest and farthest distance tell whether a shell meets it at all.
Depths are found to the bit as projection finds them, so that no splat changes shell.
"""

import math
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.fsr.kernels.depth_sort_scalar import KEYS
from renderers.fsr.splats.splat_tiles import ACROSS, BLOCKS

F32 = NDArray[np.float32]
I32 = NDArray[np.int32]
U16 = NDArray[np.uint16]
I64 = NDArray[np.int64]
Real = float | np.float32

SPAN = 4
"""Blocks that a footprint may meet along an axis and still be found hidden."""

FIRST_BLOCK = 3 | 3 << ACROSS
"""A tile's squares that are its first block, as bits."""

ROW_BITS = (1 << SPAN) - 1

_ZERO = np.float32(0)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def key_of(depth: Real, low: Real, scale: Real) -> Any:
    """Give a depth's step among the `KEYS`, a whole number as float32."""
    step = min(max((depth - low) * scale, _ZERO), np.float32(KEYS - 1))
    return np.floor(step)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def depth_of(dx: Real, dy: Real, dz: Real, m: F32, flat: bool) -> Any:
    """Give the distance from the eye, or along a flat view."""
    z = dx * m[2, 0] + dy * m[2, 1] + dz * m[2, 2] + m[2, 3]
    if flat:
        return z
    x = dx * m[0, 0] + dy * m[0, 1] + dz * m[0, 2] + m[0, 3]
    y = dx * m[1, 0] + dy * m[1, 1] + dz * m[1, 2] + m[1, 3]
    return np.float32(math.sqrt(x * x + y * y + z * z))


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _gather_sets(waiting: I32) -> None:
    """Turn zeros and ones of blocks into sets, see `find_waiting`."""
    down, wide = waiting.shape
    for b in range(down):
        # a row from its end: bit r tells of the blocks up to r to the right
        found = 0
        for a in range(wide - 1, -1, -1):
            found = ROW_BITS if waiting[b, a] else (found << 1) & ROW_BITS
            waiting[b, a] = found
    for b in range(down):
        for a in range(wide):
            found = waiting[b, a]
            for d in range(1, SPAN):
                below = waiting[b + d, a] if b + d < down else 0
                found |= (found >> SPAN * (d - 1) | below) << SPAN * d
            waiting[b, a] = found


@njit(cache=True, nogil=True, error_model="numpy")
def find_waiting(alive: I64, down: int, across: int, waiting: I32) -> None:
    """Tell where a picture takes light, in blocks of two by two squares and in tiles.

    alive: ``(down * across,)`` squares that do, by tile. waiting: ``(BLOCKS down + 2,
    BLOCKS across + 2)`` blocks, with one beyond the picture on each side, then ``(down
    + 2, across + 2)`` tiles. Bit r + SPAN d tells whether any up to r to the right and
    d below does.
    """
    high, wide = BLOCKS * down + 2, BLOCKS * across + 2
    waiting[:] = 0
    blocks = waiting[: high * wide].reshape(high, wide)
    tiles = waiting[high * wide :].reshape(down + 2, across + 2)
    for tile in range(down * across):
        b, a = tile // across, tile % across
        if alive[tile] == 0:
            continue
        tiles[b + 1, a + 1] = 1
        for block in range(BLOCKS * BLOCKS):
            d, r = block // BLOCKS, block % BLOCKS
            if (alive[tile] >> 2 * (d * ACROSS + r)) & FIRST_BLOCK:
                blocks[b * BLOCKS + d + 1, a * BLOCKS + r + 1] = 1
    _gather_sets(blocks)
    _gather_sets(tiles)


@njit(cache=True, nogil=True, error_model="numpy")
def take_shell(
    spans: I32, lowest: U16, highest: U16, ny: int, columns: U16, base: F32,
    matrix: F32, projection: int, low: Real, scale: Real, near_mm: Real, first_key: int,
    end_key: int, lens: Real, reach_mm: Real, width: int, height: int, waiting: I32,
    index: I32, keys: I32,
) -> int:  # fmt: skip
    """List elements of spans whose key is one of first_key..end_key - 1, and the keys.

    See `survey_spans`; near elements are left out. lens: pixels per radian, tangent or
    mm. reach_mm: radius of an element. waiting: see `find_waiting`; no elements where
    all take light. Those that only finished blocks could show are left out, or
    not: it changes no pixel, and this twin does not. Returns the number listed; index
    and keys have sixteen to spare.
    """
    n = 0
    flat = projection == 2
    for span in range(spans.shape[0]):
        if highest[span] < first_key or lowest[span] >= end_key:
            continue
        row, first, end = spans[span, 0], spans[span, 1], spans[span, 2]
        k = np.uint32(row) // np.uint32(ny)
        dy = np.float32(np.uint32(row) - k * np.uint32(ny)) - base[1]
        dz = np.float32(k) - base[2]
        for s in range(first, end):
            depth = depth_of(np.float32(columns[s]) - base[0], dy, dz, matrix, flat)
            key = int(key_of(depth, low, scale))
            if first_key <= key < end_key and not depth < near_mm:
                index[n] = s
                keys[n] = key
                n += 1
    return n
