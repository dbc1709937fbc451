"""Splats of mode `classic` composited, a square of sixteen pixels at a time.

The method is told in the scalar twin; operations and their order are the twin's.
"""

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.fsr.classic.kernels import (
    DARK,
    EDGE,
    FALL,
    FLAT,
    limit_tile,
    sheet_of,
    squares_of_box,
)
from renderers.fsr.classic.ordering.vector.kernels import list_run, list_tile
from renderers.fsr.classic.projection.kernels import CUT, RECORD
from renderers.fsr.classic.projection.vector.kernels import absorbed
from renderers.fsr.classic.tiles import (
    ACROSS,
    SIDE,
    SQUARE,
    SQUARES,
    STATE,
    TILE_SIDE,
)
from renderers.simd import (
    absolute,
    any_,
    bits,
    f32,
    full,
    lanes,
    load,
    maximum,
    put_rows4,
    select,
    store,
    store_groups,
)

F32 = NDArray[np.float32]
I32 = NDArray[np.int32]
I64 = NDArray[np.int64]
Real = float | np.float32

_DE_BRUIJN = 0x03F79D71B4CB0A89
"""All numbers of six bits occur in it: a power of two times it tells the power."""

_POWERS = np.empty(64, np.int64)
_POWERS[[(_DE_BRUIJN << n & (1 << 64) - 1) >> 58 for n in range(64)]] = range(64)

_ONE = np.float32(1)
_ZERO = np.float32(0)
_HALF = np.float32(0.5)
_REST = np.float32(0.5 * SIDE - 0.5)
"""Pixel centres of a square lie this far from its middle, along an axis."""

_BEYOND = np.float32(CUT * CUT + 0.01)

_WIDE = np.float32(0.18)
"""Inverse variance of footprints so wide that leaving out their corners pays."""


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _squares_of_ellipse(dx: Any, dy: Any, curve: Any, twist: Any, rise: Any) -> Any:
    """Give the squares of a tile that a footprint may meet, a bit each.

    dx, dy: the centre from the tile's first pixel. Half widths are taken at the row
    of the square that is nearest to the centre.
    """
    slope = twist / curve
    y = f32((lanes(SQUARES) >> 3) * SIDE) + (_REST - dy)
    x = f32((lanes(SQUARES) & 7) * SIDE) + (_REST - dx)
    beside = maximum(absolute(y) - _REST, _ZERO)
    rest = _BEYOND - beside * beside * (rise - twist * slope)
    across = absolute(x + y * slope) - (_REST + _REST * abs(slope))
    across = maximum(across, _ZERO)
    return bits(across * across * curve <= rest)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _footprint(z: Any) -> Any:
    """Weigh pixels: one at the centre, zero from the cut on."""
    z = maximum(z, np.float32(-0.57))
    g = z * FALL[2] + FALL[1]
    g = g * z + FALL[0]
    g = g * z + _ONE
    g = g * g
    g = g * g
    g = g * g
    return maximum(g - np.float32(EDGE), _ZERO)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _close_tile(
    state: F32, depths: F32, left: int, top: int, with_depth: bool, image: F32,
    depth: F32,
) -> None:  # fmt: skip
    """Write a tile's part of the picture: premultiplied RGBA, and depth if wanted."""
    height, width = image.shape[0], image.shape[1]
    for k in range(SQUARES):
        x = left + k % ACROSS * SIDE
        y = top + k // ACROSS * SIDE
        if x >= width or y >= height:
            continue
        at = k * STATE
        if x + SIDE <= width and y + SIDE <= height:
            alpha = _ONE - load(state, at, SQUARE)
            red = load(state, at + SQUARE, SQUARE)
            green = load(state, at + 2 * SQUARE, SQUARE)
            blue = load(state, at + 3 * SQUARE, SQUARE)
            pixel = (lanes(SQUARE) >> 2) * width + (lanes(SQUARE) & 3)
            place = pixel + np.int32(y * width + x)
            put_rows4(image, place, red, green, blue, alpha)
            if with_depth:
                store_groups(
                    depth, y * width + x, width, load(depths, k * SQUARE, SQUARE)
                )
            continue
        for p in range(SQUARE):
            a = x + p % SIDE
            b = y + p // SIDE
            if a < width and b < height:
                image[b, a, 0] = state[at + SQUARE + p]
                image[b, a, 1] = state[at + 2 * SQUARE + p]
                image[b, a, 2] = state[at + 3 * SQUARE + p]
                image[b, a, 3] = _ONE - state[at + p]
                if with_depth:
                    depth[b, a] = depths[k * SQUARE + p]


@njit(cache=True, nogil=True, error_model="numpy")
def _blend_splats(
    records: F32, boxes: I32, items: I32, left: int, top: int, points: bool, cut: Real,
    limits: F32, with_depth: bool, state: F32, depths: F32, alive: Any,
) -> Any:  # fmt: skip
    """Do as the scalar twin."""
    limited = limits.size > 0
    one = np.int64(1)
    a = f32(lanes(SQUARE) & 3)
    b = f32(lanes(SQUARE) >> 2)
    squares = 0
    for m in range(items.shape[0]):
        if alive == 0:
            break
        o = items[m] * RECORD
        u, v, far = records[o], records[o + 1], records[o + 6]
        curve, twist, rise = records[o + 2], records[o + 3], records[o + 4]
        gain = records[o + 5]
        if not points:
            gain = gain * np.float32(1 / (1 - EDGE))
        red, green, blue = records[o + 8], records[o + 9], records[o + 10]
        slim = curve * FLAT
        cross = twist * (FLAT * np.float32(2))
        flat = rise * FLAT
        live = squares_of_box(boxes[o + 7], boxes[o + 11], left, top) & alive
        x = u - np.float32(left) - _HALF
        y = v - np.float32(top) - _HALF
        if not points and curve < _WIDE:
            live &= _squares_of_ellipse(x, y, curve, twist, rise)
        while live != 0:
            k = _POWERS[((live & -live) * _DE_BRUIJN) >> 58 & 63]
            live &= live - one
            squares += 1
            x0 = np.float32((k & 7) * SIDE) - x
            y0 = np.float32((k >> 3) * SIDE) - y
            if points:
                dx = a + x0
                dy = b + y0
                inside = (dx >= -curve) & (dx < curve)
                inside &= (dy >= -curve) & (dy < curve)
                w = select(inside, gain, dx * _ZERO)
            else:
                dx = a + x0
                dy = b + y0
                w = _footprint(dx * (dx * slim + dy * cross) + dy * dy * flat) * gain
            if limited:
                w = select(load(limits, k * SQUARE, SQUARE) > far, w, _ZERO)
            at = k * STATE
            before = load(state, at, SQUARE)
            w = w * before
            after = before - w
            after = maximum(after, np.float32(DARK))
            store(state, at, after)
            at += SQUARE
            store(state, at, load(state, at, SQUARE) + w * red)
            at += SQUARE
            store(state, at, load(state, at, SQUARE) + w * green)
            at += SQUARE
            store(state, at, load(state, at, SQUARE) + w * blue)
            if with_depth:
                fallen = (before > _HALF) & (after <= _HALF)
                old = load(depths, k * SQUARE, SQUARE)
                store(depths, k * SQUARE, select(fallen, far, old))
            if not any_(after > cut):
                alive &= ~(one << k)
    return alive, squares


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _end_sheet(
    k: int, sums: F32, cut: Real, with_depth: bool, state: F32, depths: F32, far: F32
) -> bool:
    """Blend a square's sheet as one layer; say whether light is left."""
    at = k * STATE
    tau = load(sums, at, SQUARE)
    before = load(state, at, SQUARE)
    share = before * absorbed(tau)
    after = before - share
    after = maximum(after, np.float32(DARK))
    scale = share / maximum(tau, np.float32(1e-30))
    zero = full(_ZERO, SQUARE)
    store(state, at, after)
    store(sums, at, zero)
    for c in range(at + SQUARE, at + STATE, SQUARE):
        store(state, c, load(state, c, SQUARE) + scale * load(sums, c, SQUARE))
        store(sums, c, zero)
    if with_depth:
        fallen = (before > _HALF) & (after <= _HALF)
        old = load(depths, k * SQUARE, SQUARE)
        store(depths, k * SQUARE, select(fallen, far[k], old))
    bright: bool = any_(after > cut)
    return bright


@njit(cache=True, nogil=True, error_model="numpy")
def _sum_sheets(
    records: F32, boxes: I32, items: I32, left: int, top: int, low: Real, scale: Real,
    thickness: Real, cut: Real, limits: F32, with_depth: bool, sums: F32, sheets: I32,
    far: F32, state: F32, depths: F32, alive: Any,
) -> Any:  # fmt: skip
    """Do as the scalar twin."""
    sums[:] = 0
    sheets[:] = -1
    limited = limits.size > 0
    one = np.int64(1)
    a = f32(lanes(SQUARE) & 3)
    b = f32(lanes(SQUARE) >> 2)
    squares = 0
    for m in range(items.shape[0]):
        if alive == 0:
            break
        o = items[m] * RECORD
        u, v, here = records[o], records[o + 1], records[o + 6]
        curve, twist, rise = records[o + 2], records[o + 3], records[o + 4]
        gain = records[o + 5] * np.float32(1 / (1 - EDGE))
        red, green, blue = records[o + 8], records[o + 9], records[o + 10]
        sheet = sheet_of(here, low, scale, thickness)
        slim = curve * FLAT
        cross = twist * (FLAT * np.float32(2))
        flat = rise * FLAT
        live = squares_of_box(boxes[o + 7], boxes[o + 11], left, top) & alive
        x = u - np.float32(left) - _HALF
        y = v - np.float32(top) - _HALF
        if curve < _WIDE:
            live &= _squares_of_ellipse(x, y, curve, twist, rise)
        while live != 0:
            k = _POWERS[((live & -live) * _DE_BRUIJN) >> 58 & 63]
            live &= live - one
            if sheets[k] != sheet:
                bright = _end_sheet(k, sums, cut, with_depth, state, depths, far)
                sheets[k] = sheet
                far[k] = low + (np.float32(sheet) + _HALF) * thickness / scale
                if not bright:
                    alive &= ~(one << k)
                    continue
            squares += 1
            x0 = np.float32((k & 7) * SIDE) - x
            y0 = np.float32((k >> 3) * SIDE) - y
            dx = a + x0
            dy = b + y0
            w = _footprint(dx * (dx * slim + dy * cross) + dy * dy * flat) * gain
            if limited:
                w = select(load(limits, k * SQUARE, SQUARE) > here, w, _ZERO)
            at = k * STATE
            store(sums, at, load(sums, at, SQUARE) + w)
            at += SQUARE
            store(sums, at, load(sums, at, SQUARE) + w * red)
            at += SQUARE
            store(sums, at, load(sums, at, SQUARE) + w * green)
            at += SQUARE
            store(sums, at, load(sums, at, SQUARE) + w * blue)
    for k in range(SQUARES):
        if sheets[k] < 0:
            continue
        if not _end_sheet(k, sums, cut, with_depth, state, depths, far):
            alive &= ~(one << k)
    return alive, squares


@njit(cache=True, nogil=True, error_model="numpy")
def draw_tiles(
    records: F32, boxes: I32, ranges: I32, parts: I64, first: int, end: int,
    across: int, points: bool, cut: Real, sheets_of: F32, limit_mm: F32, last: bool,
    items: I32, limits: F32, sums: F32, sheets: I32, far: F32, states: F32, depths: F32,
    alive: I64, image: F32, depth: F32,
) -> int:  # fmt: skip
    """Do as the scalar twin."""
    fragments = 0
    with_depth = depth.size > 0
    row = first // across
    top = row * TILE_SIDE
    column = first - row * across
    some = list_run(
        ranges, parts, row, column, column + end - first - 1, items[0], items[1]
    )
    for t in range(first, end):
        if alive[t] == 0:
            continue
        column = t - row * across
        left = column * TILE_SIDE
        limited = limit_mm.size > 0 and limit_tile(limit_mm, left, top, limits)
        bound = limits if limited else limits[:0]
        listed = items[2, : list_tile(items[0], items[1], some, column, items[2])]
        if sheets_of.size > 0:
            alive[t], squares = _sum_sheets(
                records, boxes, listed, left, top, sheets_of[0], sheets_of[1],
                sheets_of[2], cut, bound, with_depth, sums, sheets, far, states[t],
                depths[t], alive[t],
            )  # fmt: skip
        else:
            alive[t], squares = _blend_splats(
                records, boxes, listed, left, top, points, cut, bound, with_depth,
                states[t], depths[t], alive[t],
            )  # fmt: skip
        fragments += squares * SQUARE
        if last or alive[t] == 0:
            _close_tile(states[t], depths[t], left, top, with_depth, image, depth)
    return fragments
