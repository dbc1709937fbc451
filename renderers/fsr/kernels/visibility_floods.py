"""What no eye in a box of voxels can see, by floods of bits along narrow beams.

A cell of the grid (eight neighbouring grid points at its corners) holds air only if one
of its corners does, since a trilinear field is least at a corner. A line of sight runs
through such cells alone. The lines that leave a box within a narrow range of slopes
are followed together, layer of cells after layer: a cell is reached only through a
neighbour that was, on the side the lines come from, and only inside the beam that the
box and the slopes span. That leaves nothing out that is in sight, however thin what
blocks it; it may keep what only a crooked line within one beam would reach.

A row of 64 cells across a beam is one word.
"""

import math

import numpy as np
from numba import njit

from renderers.fsr.kernels.array_types import F32, I64, U8, U64, Lanes

WORD = 64
_ONE = np.uint64(1)
_NONE = np.uint64(0)


@njit(cache=True, nogil=True, error_model="numpy")
def air_rows(values: F32, air: U64) -> None:
    """Set a bit per cell that may hold air.

    values: ``(c, b, a)`` distances, air where not positive. air: ``(c - 1, b - 1,
    words)``, zeros; bits run along the last axis.
    """
    for k in range(values.shape[0] - 1):
        for j in range(values.shape[1] - 1):
            for i in range(values.shape[2] - 1):
                least = values[k, j, i]
                for corner in range(1, 8):
                    a, b, c = corner & 1, (corner >> 1) & 1, corner >> 2
                    least = min(least, values[k + c, j + b, i + a])
                if least <= 0:
                    air[k, j, i // WORD] |= _ONE << np.uint64(i % WORD)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _word(rows: U64, k: int, j: int, at: int) -> Lanes:
    """Read 64 bits of a row from bit `at` on, zeros beyond its ends."""
    n = rows.shape[2]
    w = at >> 6
    s = np.uint64(at & 63)
    low = rows[k, j, w] if 0 <= w < n else _NONE
    if s == 0:
        return low
    high = rows[k, j, w + 1] if -1 <= w < n - 1 else _NONE
    return (low >> s) | (high << (np.uint64(64) - s))


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _put(rows: U64, k: int, j: int, at: int, bits: Lanes) -> None:
    """Add 64 bits to a row from bit `at` on; none of them is beyond its ends."""
    w = at >> 6
    s = np.uint64(at & 63)
    low = bits << s
    if low != 0:
        rows[k, j, w] |= low
    if s != 0:
        high = bits >> (np.uint64(64) - s)
        if high != 0:
            rows[k, j, w + 1] |= high


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _across(
    low: int, high: int, slope0: float, slope1: float, length: int, here: int
) -> tuple[int, int]:
    """Bound a beam's cells in a layer: of `length` layers of the box, or beyond.

    low, high: the box's first and last cell across. here: layers from the box's first.
    """
    # lines begin anywhere in the box and leave this layer at its far side
    far = here + 1
    near = max(here - length, 0)
    first = low + (slope0 * far if slope0 < 0 else slope0 * near)
    last = high + 1 + (slope1 * far if slope1 > 0 else slope1 * near)
    return math.floor(first - 1e-9), math.floor(last + 1e-9)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _span(first: int, last: int) -> Lanes:
    """Set bits first to last of a word; none where that is empty."""
    if last < 0 or first > 63 or last < first:
        return _NONE
    first = max(first, 0)
    last = min(last, 63)
    return (~_NONE >> np.uint64(63 - last)) & (~_NONE << np.uint64(first))


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _moved(bits: Lanes, shift: int) -> Lanes:
    """Return a row's bits as a word that begins `shift` cells farther on has them."""
    if shift >= WORD or shift <= -WORD:
        return _NONE
    return bits >> np.uint64(shift) if shift >= 0 else bits << np.uint64(-shift)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _sideways(bits: Lanes, slope0: float, slope1: float) -> Lanes:
    """Add the cells next to those of a row that a line of a beam may pass into."""
    wider = bits
    if slope1 > 0:
        wider |= bits << _ONE
    if slope0 < 0:
        wider |= bits >> _ONE
    return wider


@njit(cache=True, nogil=True, error_model="numpy")
def _follow(
    air: U64, cells: int, low: I64, high: I64, step: int, a0: float, a1: float,
    b0: float, b1: float, seen: U64, rows: U64, open_: U64,
) -> None:  # fmt: skip
    """Follow the lines of one beam until none is left or the grid ends."""
    layers, across = air.shape[0], air.shape[1]
    origin = low[0] if step > 0 else high[0]
    deep = high[0] - low[0] + 1
    base = low[2]
    j0, j1 = 0, -1
    here = 0
    while 0 <= origin + step * here < layers:
        k = origin + step * here
        first, last = _across(low[2], high[2], a0, a1, deep, here)
        y0, y1 = _across(low[1], high[1], b0, b1, deep, here)
        y0 = max(y0, 0)
        y1 = min(y1, across - 1)
        mask = _span(0, min(last, cells - 1) - first)
        if y1 < y0:
            return
        # on from the layer before, in cells that may hold air; eyes may be in the box
        for j in range(y0, y1 + 1):
            bits = _moved(rows[j], first - base) if j0 <= j <= j1 else _NONE
            if here < deep and low[1] <= j <= high[1]:
                bits |= _span(low[2] - first, high[2] - first)
            open_[j] = _word(air, k, j, first) & mask
            bits &= open_[j]
            rows[j] = _sideways(bits, a0, a1) & open_[j]
        base, j0, j1 = first, y0, y1
        # within a layer a line passes by at most one cell each way
        if b1 > 0:
            for j in range(j1, j0, -1):
                rows[j] |= rows[j - 1] & open_[j]
        if b0 < 0:
            for j in range(j0, j1):
                rows[j] |= rows[j + 1] & open_[j]
        alive = _NONE
        for j in range(j0, j1 + 1):
            rows[j] = _sideways(rows[j], a0, a1) & open_[j]
            if rows[j] != 0:
                alive |= rows[j]
                _put(seen, k, j, base, rows[j])
        here += 1
        if alive == 0 and here >= deep:
            return


@njit(cache=True, nogil=True, error_model="numpy")
def flood_beams(
    air: U64, cells: int, low: I64, high: I64, beams: int, seen: U64, rows: U64,
    open_: U64,
) -> None:  # fmt: skip
    """Set the bits of all cells in sight along the first axis, both ways.

    air, seen: as in `air_rows`. cells: along the last axis. low, high: first and last
    cell of the box, in the order of the axes. beams: ranges of slopes across, each
    way, from -1 to 1; a beam is nowhere wider than a word. rows, open_: scratch of
    words, one per cell along the second axis.
    """
    width = 2.0 / beams
    for way in range(2):
        for row in range(beams):
            b0 = -1.0 + width * row
            for column in range(beams):
                a0 = -1.0 + width * column
                _follow(
                    air, cells, low, high, 1 - 2 * way, a0, a0 + width, b0, b0 + width,
                    seen, rows, open_,
                )  # fmt: skip


@njit(cache=True, nogil=True, error_model="numpy")
def turn_rows(turned: U64, rows: U64) -> None:
    """Add to ``rows[c, b]`` (bits along a) what ``turned[a, c]`` (along b) has."""
    for a in range(turned.shape[0]):
        bit = _ONE << np.uint64(a % WORD)
        for c in range(turned.shape[1]):
            for w in range(turned.shape[2]):
                word = turned[a, c, w]
                b = w * WORD
                while word != 0:
                    if word & _ONE:
                        rows[c, b, a // WORD] |= bit
                    word >>= _ONE
                    b += 1


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _meets(rows: U64, box: I64) -> bool:
    """True if any bit is set in a box of cells, first and last of each axis."""
    first, last = box[0] // WORD, box[3] // WORD
    for k in range(box[2], box[5] + 1):
        for j in range(box[1], box[4] + 1):
            for w in range(first, last + 1):
                if rows[k, j, w] & _span(box[0] - w * WORD, box[3] - w * WORD):
                    return True
    return False


@njit(cache=True, nogil=True, error_model="numpy")
def mark_met(rows: U64, groups: I64, boxes: I64, first: I64, met: U8) -> None:
    """Mark the boxes of cells in which any bit is set.

    boxes: ``(n, 6)``, first cell (i, j, k) and last. groups: boxes around
    ``boxes[first[g] : first[g + 1]]``, asked first.
    """
    for g in range(groups.shape[0]):
        asked = _meets(rows, groups[g])
        for b in range(first[g], first[g + 1]):
            met[b] = 1 if asked and _meets(rows, boxes[b]) else 0
