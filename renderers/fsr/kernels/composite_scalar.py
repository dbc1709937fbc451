"""Splats of mode `classic` composited into a tile, near ones first.

What is left of the light at a pixel, T, falls with every splat before it; a square of
pixels where it has all but gone takes no more. Splats are blended one by one, or, in
sheets, summed as optical depth as long as they are in one layer of depth.
"""

import math
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.fsr.kernels.depth_slabs_scalar import key_of
from renderers.fsr.kernels.depth_sort_scalar import list_entries, list_tile
from renderers.fsr.kernels.project_splats_scalar import RECORD, absorbed
from renderers.fsr.kernels.tile_buffer import (
    clear_tile,
    close_tile,
    limit_tile,
    next_run,
    open_tile,
)
from renderers.fsr.splats.gaussian_falloff import BEND, EDGE, LIFT, REST, SHIFT
from renderers.fsr.splats.splat_tiles import (
    ACROSS,
    SIDE,
    SQUARE,
    SQUARES,
    STATE,
    TILE_SIDE,
)
from renderers.lanes.fma import muladd

F32 = NDArray[np.float32]
I32 = NDArray[np.int32]
I64 = NDArray[np.int64]
Flags = NDArray[np.bool_]
Real = float | np.float32

DARK = 1e-20
"""Light that every splat leaves: the smallest numbers take a hundred cycles. It is far
below what rounding takes from light that shows."""

FRAGMENT_BITS = 8
"""Fragments of a square are counted in parts of 256."""

_ONE = np.float32(1)
_ZERO = np.float32(0)
_HALF = np.float32(0.5)

EACH_ROW = 0x0101010101010101
"""The first square of every row of a tile."""


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def squares_of_box(box_x: int, box_y: int, left: int, top: int) -> Any:
    """Give the squares of a tile that a box of pixels meets, a bit each.

    And the pixels of the box per square, in parts of 2 ** `FRAGMENT_BITS`.
    """
    x0 = max((box_x & 0xFFFF) - left, 0)
    x1 = min((box_x >> 16) - left, TILE_SIDE - 1)
    y0 = max((box_y & 0xFFFF) - top, 0)
    y1 = min((box_y >> 16) - top, TILE_SIDE - 1)
    pixels = (x1 - x0 + 1) * (y1 - y0 + 1) << FRAGMENT_BITS
    x0, x1, y0, y1 = x0 // SIDE, x1 // SIDE, y0 // SIDE, y1 // SIDE
    columns = (np.int64(2) << x1) - (np.int64(1) << x0)
    # one row's bits, copied into rows y0 to y1
    rows = np.int64(EACH_ROW) >> (ACROSS * (ACROSS - 1 - y1))
    squares = (x1 - x0 + 1) * (y1 - y0 + 1)
    return columns * (rows & (np.int64(-1) << (ACROSS * y0))), pixels // squares


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def footprint(dx: Any, dy: Any, slim: Any, cross: Any, flat: Any) -> Any:
    """Weigh a pixel: zero from the cut on; `WEIGHT` times this is one at the centre."""
    beside = muladd(dx, slim, dy * cross)
    y = min(muladd(dx, beside, muladd(dy * dy, flat, -SHIFT)), EDGE)
    q = muladd(y, y, BEND)
    r = muladd(q, q - y, LIFT)
    # rounded twice: nothing is left at the cut
    return r * r - REST


@njit(cache=True, nogil=True, error_model="numpy")
def _blend_splats(
    records: F32, boxes: I32, items: I32, left: int, top: int, points: bool, cut: Real,
    limits: F32, with_depth: bool, state: F32, depths: F32, alive: Any,
) -> Any:  # fmt: skip
    """Blend a tile's splats one by one; give its live squares, and the fragments."""
    fragments = 0
    for m in range(items.shape[0]):
        if alive == 0:
            break
        s = items[m]
        o = s * RECORD
        u, v, far = records[o], records[o + 1], records[o + 6]
        slim, cross, flat = records[o + 2], records[o + 3], records[o + 4]
        half = slim
        gain = records[o + 5]
        met, pixels = squares_of_box(boxes[s, 0], boxes[s, 1], left, top)
        met &= alive
        for k in range(SQUARES):
            if not (met >> k) & 1:
                continue
            fragments += pixels
            bright = False
            for p in range(SQUARE):
                dx = np.float32(left + k % ACROSS * SIDE + p % SIDE) + _HALF - u
                dy = np.float32(top + k // ACROSS * SIDE + p // SIDE) + _HALF - v
                at = k * STATE + p
                before = state[at]
                if points:
                    inside = -half <= dx < half and -half <= dy < half
                    w = before * gain if inside else _ZERO
                else:
                    w = before * (footprint(dx, dy, slim, cross, flat) * gain)
                if limits.size > 0 and not far < limits[k * SQUARE + p]:
                    w = _ZERO
                after = before - w + np.float32(DARK)
                state[at] = after
                for c in range(3):
                    color = at + (c + 1) * SQUARE
                    state[color] = muladd(w, records[o + 8 + c], state[color])
                if with_depth and before > _HALF and after <= _HALF:
                    depths[k * SQUARE + p] = far
                bright = bright or after > cut
            if not bright:
                alive &= ~(np.int64(1) << k)
    return alive, fragments


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _end_sheet(
    k: int, sums: F32, cut: Real, with_depth: bool, state: F32, depths: F32, far: F32
) -> bool:
    """Blend a square's sheet as one layer; say whether light is left."""
    bright = False
    for p in range(SQUARE):
        at = k * STATE + p
        tau = sums[at]
        before = state[at]
        share = before * absorbed(tau)
        after = before - share + np.float32(DARK)
        scale = share / max(tau, np.float32(1e-30))
        state[at] = after
        sums[at] = _ZERO
        for c in range(SQUARE, STATE, SQUARE):
            state[at + c] = muladd(scale, sums[at + c], state[at + c])
            sums[at + c] = _ZERO
        if with_depth and before > _HALF and after <= _HALF:
            depths[k * SQUARE + p] = far[k]
        bright = bright or after > cut
    return bright


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def sheet_of(depth: Real, low: Real, scale: Real, thickness: Real) -> Any:
    """Number a depth's sheet by its key, so that no sheet is come back to."""
    return math.floor(key_of(depth, low, scale) / thickness)


@njit(cache=True, nogil=True, error_model="numpy")
def _sum_sheets(
    records: F32, boxes: I32, items: I32, left: int, top: int, low: Real, scale: Real,
    thickness: Real, cut: Real, limits: F32, with_depth: bool, sums: F32, sheets: I32,
    far: F32, state: F32, depths: F32, alive: Any,
) -> Any:  # fmt: skip
    """Do as `_blend_splats`, but sum optical depth per sheet of depth."""
    sums[:] = 0
    sheets[:] = -1
    fragments = 0
    for m in range(items.shape[0]):
        if alive == 0:
            break
        s = items[m]
        o = s * RECORD
        u, v, here = records[o], records[o + 1], records[o + 6]
        slim, cross, flat = records[o + 2], records[o + 3], records[o + 4]
        gain = records[o + 5]
        sheet = sheet_of(here, low, scale, thickness)
        met, pixels = squares_of_box(boxes[s, 0], boxes[s, 1], left, top)
        met &= alive
        for k in range(SQUARES):
            if not (met >> k) & 1:
                continue
            if sheets[k] != sheet:
                bright = _end_sheet(k, sums, cut, with_depth, state, depths, far)
                sheets[k] = sheet
                far[k] = low + (np.float32(sheet) + _HALF) * thickness / scale
                if not bright:
                    alive &= ~(np.int64(1) << k)
                    continue
            fragments += pixels
            for p in range(SQUARE):
                dx = np.float32(left + k % ACROSS * SIDE + p % SIDE) + _HALF - u
                dy = np.float32(top + k // ACROSS * SIDE + p // SIDE) + _HALF - v
                w = footprint(dx, dy, slim, cross, flat) * gain
                if limits.size > 0 and not here < limits[k * SQUARE + p]:
                    w = _ZERO
                at = k * STATE + p
                sums[at] += w
                for c in range(3):
                    color = at + (c + 1) * SQUARE
                    sums[color] = muladd(w, records[o + 8 + c], sums[color])
    for k in range(SQUARES):
        if sheets[k] < 0:
            continue
        if not _end_sheet(k, sums, cut, with_depth, state, depths, far):
            alive &= ~(np.int64(1) << k)
    return alive, fragments


@njit(cache=True, nogil=True, error_model="numpy")
def draw_tiles(
    records: F32, boxes: I32, entries: I64, count: int, turns: I64,
    points: bool, cut: Real, sheets_of: F32, limit_mm: F32, fresh: Flags, last: bool,
    items: I32, limits: F32, sums: F32, sheets: I32, far: F32, states: F32, depths: F32,
    alive: I64, drawn: I64, image: F32, depth: F32,
) -> int:  # fmt: skip
    """Blend splats into tiles, near ones first; write the tiles that are finished.

    boxes: ``(n, 4)`` of `records`, see `project_splats`. entries, count: see
    `place_by_keys`. turns: ``(1,)`` zero; threads that share it share out the tiles.
    cut: a square whose pixels all have T at or below this takes no more. sheets_of: low
    and scale, which map depth to the keys by which items are in order, and a sheet's
    thickness in keys; no elements where splats are blended one by one. limit_mm: per
    pixel of the picture the depth from which nothing is seen; no elements where there
    is none. fresh: tiles that have had no splat. last: no more will come. items: ``(8,
    n)`` scratch for all splats and sixteen more; limits, sums, sheets, far: of a tile.
    states: ``(tiles, STATE * SQUARES)``. depths: a value per pixel of each tile, or
    none. alive: each tile's squares that take light, as bits. drawn: those that have a
    state; this twin opens all of a tile. depth: where T first
    falls to one half; no elements where it is not wanted. Returns the fragments: pixels
    of the splats' boxes in squares that were drawn, in parts of 2 ** `FRAGMENT_BITS`.
    """
    fragments = 0
    with_depth = depth.size > 0
    height, width = image.shape[0], image.shape[1]
    across = (width + TILE_SIDE - 1) // TILE_SIDE
    while True:
        first, end = next_run(turns, image, alive)
        if first == end:
            break
        row = first // across
        top = row * TILE_SIDE
        start = first - row * across
        stop = start + end - first - 1
        own, listed = items[0], items[2]
        some = list_entries(entries, count, row, row, start, stop, own, items[1])
        for t in range(first, end):
            if alive[t] == 0:
                continue
            column = t - row * across
            left = column * TILE_SIDE
            found = list_tile(own, items[1], some, column, listed)
            if fresh[t] and found == 0:
                if last:
                    clear_tile(left, top, image, depth)
                continue
            if fresh[t]:
                fresh[t] = False
                alive[t] = open_tile(left, top, width, height, states[t])
                depths[t] = np.inf
            limited = limit_mm.size > 0 and limit_tile(limit_mm, left, top, limits)
            bound = limits if limited else limits[:0]
            if sheets_of.size > 0:
                alive[t], pixels = _sum_sheets(
                    records, boxes, listed[:found], left, top, sheets_of[0],
                    sheets_of[1], sheets_of[2], cut, bound, with_depth, sums, sheets,
                    far, states[t], depths[t], alive[t],
                )  # fmt: skip
            else:
                alive[t], pixels = _blend_splats(
                    records, boxes, listed[:found], left, top, points, cut, bound,
                    with_depth, states[t], depths[t], alive[t],
                )  # fmt: skip
            fragments += pixels
            if last or alive[t] == 0:
                close_tile(states[t], depths[t], left, top, with_depth, image, depth)
    return fragments
