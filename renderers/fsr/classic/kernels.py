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

from renderers.fsr.classic.projection.kernels import CUT, KEYS, RECORD, absorbed
from renderers.fsr.classic.tiles import (
    ACROSS,
    SIDE,
    SQUARE,
    SQUARES,
    STATE,
    TILE_SIDE,
)

F32 = NDArray[np.float32]
I32 = NDArray[np.int32]
Real = float | np.float32

EDGE = math.exp(-0.5 * CUT**2)

DARK = 1e-20
"""Less light than this is none: numbers near the smallest take a hundred cycles."""

# exp(z) on -0.57..0 with exp(0) = 1, least maximum error: 1.1e-6, to the eighth 9e-6
FALL = (
    np.float32(0.99994373), np.float32(0.49908273), np.float32(0.16188473),
    np.float32(0.03146967),
)  # fmt: skip

_ONE = np.float32(1)
_ZERO = np.float32(0)
_HALF = np.float32(0.5)
EACH_ROW = 0x0101010101010101
"""The first square of every row of a tile."""


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def squares_of_box(box_x: int, box_y: int, left: int, top: int) -> Any:
    """Give the squares of a tile that a box of squares holds, a bit each."""
    x0 = max((box_x & 0xFFFF) - left // SIDE, 0)
    x1 = min((box_x >> 16) - left // SIDE, ACROSS - 1)
    y0 = max((box_y & 0xFFFF) - top // SIDE, 0)
    y1 = min((box_y >> 16) - top // SIDE, ACROSS - 1)
    columns = (np.int64(2) << x1) - (np.int64(1) << x0)
    # one row's bits, copied into rows y0 to y1
    rows = np.int64(EACH_ROW) >> (ACROSS * (ACROSS - 1 - y1))
    return columns * (rows & (np.int64(-1) << (ACROSS * y0)))


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _footprint(dx: Any, records: F32, o: int, cross: Any, rest: Any) -> Any:
    """Weigh a pixel: one at the centre, zero from the cut on."""
    r2 = dx * (dx * records[o + 2] + cross) + rest
    z = max(r2 * np.float32(-1 / 16), np.float32(-0.57))
    g = z * FALL[3] + FALL[2]
    g = g * z + FALL[1]
    g = g * z + FALL[0]
    g = g * z + _ONE
    g = g * g
    g = g * g
    g = g * g
    return max(g - np.float32(EDGE), _ZERO)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def open_tile(left: int, top: int, width: int, height: int, state: F32) -> Any:
    """Let all light through where the picture is, none beyond; give its squares."""
    alive = np.int64(0)
    for k in range(SQUARES):
        x = left + k % ACROSS * SIDE
        y = top + k // ACROSS * SIDE
        if x < width and y < height:
            alive |= np.int64(1) << k
        for p in range(SQUARE):
            ahead = x + p % SIDE < width and y + p // SIDE < height
            state[k * STATE + p] = 1 if ahead else 0
            for c in range(1, 4):
                state[k * STATE + c * SQUARE + p] = 0
    return alive


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def close_tile(
    state: F32, depths: F32, left: int, top: int, with_depth: bool, image: F32,
    depth: F32,
) -> None:  # fmt: skip
    """Write a tile's part of the picture: premultiplied RGBA, and depth if wanted."""
    height, width = image.shape[0], image.shape[1]
    for y in range(top, min(top + TILE_SIDE, height)):
        for x in range(left, min(left + TILE_SIDE, width)):
            k = (y - top) // SIDE * ACROSS + (x - left) // SIDE
            p = (y - top) % SIDE * SIDE + (x - left) % SIDE
            at = k * STATE + p
            image[y, x, 0] = state[at + SQUARE]
            image[y, x, 1] = state[at + 2 * SQUARE]
            image[y, x, 2] = state[at + 3 * SQUARE]
            image[y, x, 3] = _ONE - state[at]
            if with_depth:
                depth[y, x] = depths[k * SQUARE + p]


@njit(cache=True, nogil=True, error_model="numpy")
def draw_tile(
    records: F32, boxes: I32, items: I32, left: int, top: int,
    points: bool, cut: Real, with_depth: bool, limits: F32, state: F32, depths: F32,
    image: F32, depth: F32,
) -> int:  # fmt: skip
    """Blend a tile's splats one by one, near ones first, and write its pixels.

    boxes: the memory of `records`. items: which of them, in order. cut: a square
    whose pixels all have T at or below this takes no more. limits: per pixel of the
    tile, depth from which nothing is seen, in squares; no elements where there is
    none. state, depths: scratch. depth: where T first falls to one half. Returns the
    fragments: the pixels of the squares drawn.
    """
    alive = open_tile(left, top, image.shape[1], image.shape[0], state)
    if with_depth:
        depths[:] = np.inf
    squares = 0
    for m in range(items.shape[0]):
        if alive == 0:
            break
        o = items[m] * RECORD
        u, v, far = records[o], records[o + 1], records[o + 6]
        half = records[o + 2]
        gain = records[o + 5]
        if not points:
            gain = gain * np.float32(1 / (1 - EDGE))
        met = squares_of_box(boxes[o + 7], boxes[o + 11], left, top) & alive
        for k in range(SQUARES):
            if not (met >> k) & 1:
                continue
            squares += 1
            bright = False
            for p in range(SQUARE):
                x = np.float32(k % ACROSS * SIDE) + (np.float32(left) - u + _HALF)
                y = np.float32(k // ACROSS * SIDE) + (np.float32(top) - v + _HALF)
                dx = np.float32(p % SIDE) + x
                dy = np.float32(p // SIDE) + y
                if points:
                    inside = -half <= dx < half and -half <= dy < half
                    w = gain if inside else _ZERO
                else:
                    cross = dy * (records[o + 3] * np.float32(2))
                    rest = dy * dy * records[o + 4]
                    w = _footprint(dx, records, o, cross, rest) * gain
                if limits.size > 0 and not far < limits[k * SQUARE + p]:
                    w = _ZERO
                at = k * STATE + p
                before = state[at]
                w = w * before
                after = before - w
                if after < np.float32(DARK):
                    after = _ZERO
                state[at] = after
                for c in range(3):
                    state[at + (c + 1) * SQUARE] += w * records[o + 8 + c]
                if with_depth and before > _HALF and after <= _HALF:
                    depths[k * SQUARE + p] = far
                bright = bright or after > cut
            if not bright:
                alive &= ~(np.int64(1) << k)
    close_tile(state, depths, left, top, with_depth, image, depth)
    return squares * SQUARE


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
        after = before - share
        if after < np.float32(DARK):
            after = _ZERO
        scale = share / max(tau, np.float32(1e-30))
        state[at] = after
        sums[at] = _ZERO
        for c in range(SQUARE, STATE, SQUARE):
            state[at + c] += scale * sums[at + c]
            sums[at + c] = _ZERO
        if with_depth and before > _HALF and after <= _HALF:
            depths[k * SQUARE + p] = far[k]
        bright = bright or after > cut
    return bright


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def sheet_of(depth: Real, low: Real, scale: Real, thickness: Real) -> Any:
    """Number a depth's sheet by its key, so that no sheet is come back to."""
    step = min(max((depth - low) * scale, _ZERO), np.float32(KEYS - 1))
    return math.floor(np.floor(step) / thickness)


@njit(cache=True, nogil=True, error_model="numpy")
def draw_sheets(
    records: F32, boxes: I32, items: I32, left: int, top: int,
    low: Real, scale: Real, thickness: Real, cut: Real, with_depth: bool, limits: F32,
    state: F32, depths: F32, sums: F32, sheets: I32, far: F32, image: F32, depth: F32,
) -> int:  # fmt: skip
    """Do as `draw_tile`, but sum optical depth per sheet of depth.

    low, scale: map depth to the keys by which items are in order. thickness: of a
    sheet, in keys. sums: as state. sheets, far: per square, the sheet that it sums and
    the depth of the sheet's middle.
    """
    alive = open_tile(left, top, image.shape[1], image.shape[0], state)
    if with_depth:
        depths[:] = np.inf
    sums[:] = 0
    sheets[:] = -(1 << 30)
    squares = 0
    for m in range(items.shape[0]):
        if alive == 0:
            break
        o = items[m] * RECORD
        u, v, here = records[o], records[o + 1], records[o + 6]
        gain = records[o + 5] * np.float32(1 / (1 - EDGE))
        sheet = sheet_of(here, low, scale, thickness)
        met = squares_of_box(boxes[o + 7], boxes[o + 11], left, top) & alive
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
            squares += 1
            for p in range(SQUARE):
                x = np.float32(k % ACROSS * SIDE) + (np.float32(left) - u + _HALF)
                y = np.float32(k // ACROSS * SIDE) + (np.float32(top) - v + _HALF)
                dx = np.float32(p % SIDE) + x
                dy = np.float32(p // SIDE) + y
                cross = dy * (records[o + 3] * np.float32(2))
                rest = dy * dy * records[o + 4]
                w = _footprint(dx, records, o, cross, rest) * gain
                if limits.size > 0 and not here < limits[k * SQUARE + p]:
                    w = _ZERO
                at = k * STATE + p
                sums[at] += w
                for c in range(3):
                    sums[at + (c + 1) * SQUARE] += w * records[o + 8 + c]
    for k in range(SQUARES):
        _end_sheet(k, sums, cut, with_depth, state, depths, far)
    close_tile(state, depths, left, top, with_depth, image, depth)
    return squares * SQUARE
