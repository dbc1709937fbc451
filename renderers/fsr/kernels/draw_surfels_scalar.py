"""Surfels into a G-buffer, tile by tile, one pixel after another.

The twin of `renderers.fsr.kernels.draw_surfels`, where the method is told: the same
arithmetic in the same order and so the same bits, for machines whose numba does not
compile vectors. And what both share.
"""

import math
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.fsr.kernels.project_surfels_scalar import RECORD
from renderers.fsr.surfels.surfel_tiles import (
    BLOCK,
    BLOCK_SQUARES,
    BLOCKS_X,
    BLOCKS_Y,
    RAY,
    SIDE,
    SQUARE,
    SQUARES,
    SQUARES_X,
    SQUARES_Y,
    SUMS,
    TILE_HEIGHT,
    TILE_WIDTH,
)
from renderers.lanes.atomics import take_turn

Real = float | np.float32
F32 = NDArray[np.float32]
I32 = NDArray[np.int32]

_HALF = np.float32(0.5)
_ONE = np.float32(1)
_ZERO = np.float32(0)
_INF = np.float32(np.inf)


@njit(cache=True, nogil=True, error_model="numpy")
def list_tile(ranges: I32, n: int, column: int, row: int, items: I32) -> int:
    """List which of n surfels touch a tile, in order; give their number.

    ranges: see `tile_range`. ranges and items have sixteen to spare.
    """
    found = 0
    for s in range(n):
        r = ranges[s]
        across = (r & 127) <= column <= 127 - ((r >> 8) & 127)
        if across and ((r >> 16) & 127) <= row <= 127 - ((r >> 24) & 127):
            items[found] = s
            found += 1
    return found


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _larger(x: Real, y: Real) -> Any:
    return x if x > y else y


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _smaller(x: Real, y: Real) -> Any:
    return x if x < y else y


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _spans(
    records: F32, o: int, boxes: I32, s: int, left: int, top: int, starts: I32,
    ends: I32,
) -> tuple[int, int]:  # fmt: skip
    """Find the squares of every strip that the ellipse meets."""
    for strip in range(SQUARES_Y):
        y = np.float32(strip * SIDE + top)
        dy = y + (np.float32(0.5 * SIDE) - records[o + 10])
        d = _larger(abs(dy) - np.float32(1.5), _ZERO)
        rest = _ONE - d * d * records[o + 11]
        wide = np.float32(math.sqrt(_larger(rest * records[o + 13], _ZERO)))
        wide += np.float32(1.5) * abs(records[o + 12])
        middle = dy * records[o + 12] + (records[o + 9] - np.float32(left))
        first = int(
            _smaller(_larger(middle - wide + _HALF, _ZERO), np.float32(TILE_WIDTH))
        )
        past = _smaller(middle + wide - _HALF, np.float32(TILE_WIDTH - 1))
        last = int(_larger(past, _ZERO))
        # not beyond the box, by whose blocks a surfel is left out
        first = max(first, boxes[s, 0] - left)
        last = min(last, boxes[s, 1] - left)
        met = rest >= _ZERO and past >= _ZERO and first <= last
        starts[strip] = first >> 2 if met else 0
        ends[strip] = (last >> 2) + 1 if met else 0
    return (
        max(boxes[s, 2] - top, 0) // SIDE,
        min(boxes[s, 3] - top, TILE_HEIGHT - 1) // SIDE + 1,
    )


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _refresh(nearest: F32, far: F32) -> None:
    """Take the least q of every block."""
    for by in range(BLOCKS_Y):
        for bx in range(BLOCKS_X):
            low = _INF
            for y in range(by * BLOCK_SQUARES, (by + 1) * BLOCK_SQUARES):
                at = (y * SQUARES_X + bx * BLOCK_SQUARES) * SQUARE
                for i in range(at, at + BLOCK_SQUARES * SQUARE):
                    low = _smaller(nearest[i], low)
            far[by * BLOCKS_X + bx] = low


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _farthest(far: F32, boxes: I32, s: int, left: int, top: int) -> Any:
    """Find the least q of the blocks that a box touches."""
    low = _INF
    x0 = max(boxes[s, 0] - left, 0) // BLOCK
    x1 = min(boxes[s, 1] - left, TILE_WIDTH - 1) // BLOCK
    y0 = max(boxes[s, 2] - top, 0) // BLOCK
    y1 = min(boxes[s, 3] - top, TILE_HEIGHT - 1) // BLOCK
    for by in range(y0, y1 + 1):
        for bx in range(x0, x1 + 1):
            low = min(low, far[by * BLOCKS_X + bx])
    return low


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _hide(
    records: F32, o: int, inverse: Real, core: Real, rays: F32, nearest: F32,
    square: int, end: int,
) -> None:  # fmt: skip
    """Keep the nearest q under the core in a run of squares."""
    cx, cy, cz = records[o], records[o + 1], records[o + 2]
    mx, my, mz = records[o + 3], records[o + 4], records[o + 5]
    rest = records[o + 15] + (_ONE - core)
    for k in range(square, end):
        for i in range(SQUARE):
            rx = rays[k * RAY + i]
            ry = rays[k * RAY + SQUARE + i]
            rz = rays[k * RAY + 2 * SQUARE + i]
            q = rx * mx + ry * my + rz * mz
            s = rx * cx + ry * cy + rz * cz
            old = nearest[k * SQUARE + i]
            under = q * (s - q * rest) > inverse
            nearest[k * SQUARE + i] = _larger(q, old) if under else old


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _add(
    records: F32, o: int, inverse: Real, rays: F32, limits: F32, sums: F32,
    square: int, end: int,
) -> None:  # fmt: skip
    """Sum weight, depth and normal under the disc, up to the depth limit."""
    cx, cy, cz = records[o], records[o + 1], records[o + 2]
    mx, my, mz = records[o + 3], records[o + 4], records[o + 5]
    nx, ny, nz = records[o + 6], records[o + 7], records[o + 8]
    rest = records[o + 15]
    for k in range(square, end):
        for i in range(SQUARE):
            rx = rays[k * RAY + i]
            ry = rays[k * RAY + SQUARE + i]
            rz = rays[k * RAY + 2 * SQUARE + i]
            t = _ONE / (rx * mx + ry * my + rz * mz)
            s = rx * cx + ry * cy + rz * cz
            f = t * (s - t * inverse) - rest
            met = (f > _ZERO) & (t > _ZERO) & (t < limits[k * SQUARE + i])
            w = f * f if met else _ZERO
            at = k * SUMS + i
            sums[at] += w
            sums[at + SQUARE] += w * t if met else _ZERO
            sums[at + 2 * SQUARE] += w * nx
            sums[at + 3 * SQUARE] += w * ny
            sums[at + 4 * SQUARE] += w * nz


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _resolve(sums: F32, rays: F32) -> int:
    """Divide the sums of a tile in place; count the lens's pixels left uncovered."""
    empty = 0
    for k in range(SQUARES):
        for at in range(k * SUMS, k * SUMS + SQUARE):
            w = sums[at]
            nx = sums[at + 2 * SQUARE]
            ny = sums[at + 3 * SQUARE]
            nz = sums[at + 4 * SQUARE]
            length = np.float32(math.sqrt(nx * nx + ny * ny + nz * nz))
            met = (w > _ZERO) & (length > _ZERO)
            r = _ONE / length if met else _ZERO
            sums[at] = _ONE if met else _ZERO
            sums[at + SQUARE] = sums[at + SQUARE] / w if met else _INF
            sums[at + 2 * SQUARE] = nx * r
            sums[at + 3 * SQUARE] = ny * r
            sums[at + 4 * SQUARE] = nz * r
            rz = rays[k * RAY + 2 * SQUARE + at - k * SUMS]
            empty += 1 if not met and rz != _ZERO else 0
    return empty


@njit(cache=True, nogil=True, error_model="numpy")
def write_squares(
    sums: F32, left: int, top: int, cut_only: bool, depth: F32, normal: F32,
    coverage: F32,
) -> None:  # fmt: skip
    """Write a tile's resolved squares in the picture, or only those its edges cut."""
    height, width = depth.shape
    for y in range(top, min(top + TILE_HEIGHT, height)):
        for x in range(left, min(left + TILE_WIDTH, width)):
            if cut_only and max(x // SIDE * SIDE + SIDE - width,
                                y // SIDE * SIDE + SIDE - height) <= 0:  # fmt: skip
                continue
            b, a = y - top, x - left
            at = (b // SIDE * SQUARES_X + a // SIDE) * SUMS + b % SIDE * SIDE + a % SIDE
            coverage[y, x] = sums[at]
            depth[y, x] = sums[at + SQUARE]
            for c in range(3):
                normal[y, x, c] = sums[at + (c + 2) * SQUARE]


@njit(cache=True, nogil=True, error_model="numpy")
def draw_tile(
    records: F32, boxes: I32, items: I32, n: int, rays: F32, left: int, top: int,
    split: int, inverses: F32, core: Real, behind: Real, refresh: int, nearest: F32,
    sums: F32, far: F32, starts: I32, ends: I32, squares: I32, until: I32, depth: F32,
    normal: F32, coverage: F32,
) -> tuple[int, int, int]:  # fmt: skip
    """Draw one tile's surfels and write its part of the G-buffer, as the vector twin.

    squares, until: not used; here squares are found twice.
    Returns (fragments, surfels left out, pixels left empty).
    """
    for k in range(SQUARES):
        for i in range(SQUARE):
            outside = rays[k * RAY + 2 * SQUARE + i] == _ZERO
            nearest[k * SQUARE + i] = _INF if outside else _ZERO
    sums[:] = 0
    far[:] = 0
    fragments = 0
    hidden = 0
    for m in range(n):
        s = items[m]
        o = s * RECORD
        if m % refresh == refresh - 1:
            _refresh(nearest, far)
        if _farthest(far, boxes, s, left, top) * (records[o + 14] - behind) >= _ONE:
            hidden += 1
            continue
        first, end = _spans(records, o, boxes, s, left, top, starts, ends)
        for strip in range(first, end):
            a, b = starts[strip], ends[strip]
            fragments += b - a
            base = strip * SQUARES_X
            _hide(
                records, o, inverses[int(s >= split)], core, rays, nearest, base + a,
                base + b,
            )  # fmt: skip
    _refresh(nearest, far)
    for i in range(SQUARES * SQUARE):
        q = nearest[i]
        nearest[i] = _ONE / q + behind if q > _ZERO else _ZERO
    for m in range(n):
        s = items[m]
        o = s * RECORD
        if _farthest(far, boxes, s, left, top) * (records[o + 14] - behind) >= _ONE:
            continue
        first, end = _spans(records, o, boxes, s, left, top, starts, ends)
        for strip in range(first, end):
            a, b = starts[strip], ends[strip]
            base = strip * SQUARES_X
            _add(
                records, o, inverses[int(s >= split)], rays, nearest, sums, base + a,
                base + b,
            )  # fmt: skip
    empty = _resolve(sums, rays)
    write_squares(sums, left, top, False, depth, normal, coverage)
    return fragments * SQUARE, hidden, empty


@njit(cache=True, nogil=True, error_model="numpy")
def draw_tiles(
    turns: NDArray[np.int64], across: int, records: F32, boxes: I32, ranges: I32,
    listed: int, rays: F32, split: int, inverses: F32, core: Real, behind: Real,
    refresh: int, items: I32, nearest: F32, sums: F32, far: F32, starts: I32, ends: I32,
    squares: I32, until: I32, depth: F32, normal: F32, coverage: F32,
    found: NDArray[np.int64],
) -> None:  # fmt: skip
    """Draw the tiles whose turns this thread gets, as the vector twin."""
    while True:
        tile = take_turn(turns)
        if tile >= rays.shape[0]:
            return
        row, column = tile // across, tile % across
        n = list_tile(ranges, listed, column, row, items)
        found[tile, 0], found[tile, 1], found[tile, 2] = draw_tile(
            records, boxes, items, n, rays[tile], column * TILE_WIDTH,
            row * TILE_HEIGHT, split, inverses, core, behind, refresh, nearest, sums,
            far, starts, ends, squares, until, depth, normal, coverage,
        )  # fmt: skip
