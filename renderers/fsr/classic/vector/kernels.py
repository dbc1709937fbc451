"""Splats of mode `classic` composited, a square of sixteen pixels at a time.

The method is told in the scalar twin; operations and their order are the twin's.
"""

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.fsr.classic.dealing.kernels import DEAL, deal_splats, room_for_deal
from renderers.fsr.classic.fall import BEND, EDGE, REST, SHIFT
from renderers.fsr.classic.kernels import DARK, close_tile, limit_tile, open_tile
from renderers.fsr.classic.ordering.vector.kernels import list_run, list_tile
from renderers.fsr.classic.projection.kernels import RECORD
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
    any_,
    f32,
    full,
    lanes,
    load,
    lowest,
    maximum,
    minimum,
    prefetch,
    select,
    store,
    store_groups,
    store_quads,
)

F32 = NDArray[np.float32]
I32 = NDArray[np.int32]
I64 = NDArray[np.int64]
Real = float | np.float32

_ONE = np.float32(1)
_ZERO = np.float32(0)
_HALF = np.float32(0.5)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _footprint(records: F32, o: int, u: Any, v: Any) -> Any:
    """Weigh pixels for a splat's record, see the scalar twin."""
    dx = u - records[o]
    dy = v - records[o + 1]
    y = dx * (dx * records[o + 2] + dy * records[o + 3])
    y = minimum(y + (dy * dy * records[o + 4] - SHIFT), EDGE)
    g = y * y + BEND
    g = g * g
    g = g * g
    return g * g - REST


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _close_tile(
    state: F32, depths: F32, left: int, top: int, with_depth: bool, image: F32,
    depth: F32,
) -> None:  # fmt: skip
    """Write a tile's part of the picture: premultiplied RGBA, and depth if wanted."""
    height, width = image.shape[0], image.shape[1]
    if left + TILE_SIDE > width or top + TILE_SIDE > height:
        close_tile(state, depths, left, top, with_depth, image, depth)
        return
    for k in range(SQUARES):
        pixel = (top + k // ACROSS * SIDE) * width + left + k % ACROSS * SIDE
        at = k * STATE
        alpha = _ONE - load(state, at, SQUARE)
        red = load(state, at + SQUARE, SQUARE)
        green = load(state, at + 2 * SQUARE, SQUARE)
        blue = load(state, at + 3 * SQUARE, SQUARE)
        store_quads(image, 4 * pixel, 4 * width, red, green, blue, alpha)
        if with_depth:
            store_groups(depth, pixel, width, load(depths, k * SQUARE, SQUARE))


@njit(cache=True, nogil=True, error_model="numpy")
def _blend_splats(
    records: F32, boxes: I32, items: I32, left: int, top: int, points: bool, cut: Real,
    limits: F32, with_depth: bool, deal: Any,
    state: F32, depths: F32, alive: Any,
) -> Any:  # fmt: skip
    """Do as the scalar twin, square by square, two splats at a time where it can."""
    words, offsets, shares, _ = deal
    limited = limits.size > 0
    plain = not (points or limited or with_depth)
    one = np.int64(1)
    fragments = 0
    for first in range(0, items.shape[0], DEAL):
        if alive == 0:
            break
        touched, halves = deal_splats(
            records, boxes, items, first, min(DEAL, items.shape[0] - first), left, top,
            alive, points, limits[:0], deal,
        )  # fmt: skip
        while touched != 0:
            k = lowest(touched)
            touched &= touched - one
            at = k * STATE
            light = load(state, at, SQUARE)
            red = load(state, at + SQUARE, SQUARE)
            green = load(state, at + 2 * SQUARE, SQUARE)
            blue = load(state, at + 3 * SQUARE, SQUARE)
            bound = load(limits, k * SQUARE, SQUARE) if limited else light
            deep = load(depths, k * SQUARE, SQUARE) if with_depth else light
            u = f32((lanes(SQUARE) & 3) + np.int32(left + (k & 7) * SIDE)) + _HALF
            v = f32((lanes(SQUARE) >> 2) + np.int32(top + (k >> 3) * SIDE)) + _HALF
            half = 0
            those = words[k]
            while True:
                if those == 0:
                    half += 1
                    if half == halves:
                        break
                    those = words[half * SQUARES + k]
                    continue
                m = half * SQUARES + lowest(those)
                o = offsets[m]
                rest = those & (those - one)
                if plain and rest != 0:
                    # the weights of two ask nothing of each other
                    n = half * SQUARES + lowest(rest)
                    p = offsets[n]
                    w = _footprint(records, o, u, v) * (light * records[o + 5])
                    next_ = _footprint(records, p, u, v)
                    middle = maximum(light - w, np.float32(DARK))
                    next_ = next_ * (middle * records[p + 5])
                    after = maximum(middle - next_, np.float32(DARK))
                    if any_(after > cut):
                        light = after
                        red = red + w * records[o + 8] + next_ * records[p + 8]
                        green = green + w * records[o + 9] + next_ * records[p + 9]
                        blue = blue + w * records[o + 10] + next_ * records[p + 10]
                        fragments += shares[m] + shares[n]
                        those = rest & (rest - one)
                        continue
                those = rest
                fragments += shares[m]
                w = light * records[o + 5]
                if points:
                    side = records[o + 2]
                    dx = u - records[o]
                    dy = v - records[o + 1]
                    inside = (dx >= -side) & (dx < side)
                    inside &= (dy >= -side) & (dy < side)
                    w = select(inside, w, _ZERO)
                else:
                    w = _footprint(records, o, u, v) * w
                if limited:
                    w = select(bound > records[o + 6], w, _ZERO)
                before = light
                light = maximum(light - w, np.float32(DARK))
                red = red + w * records[o + 8]
                green = green + w * records[o + 9]
                blue = blue + w * records[o + 10]
                if with_depth:
                    fallen = (before > _HALF) & (light <= _HALF)
                    deep = select(fallen, records[o + 6], deep)
                if not any_(light > cut):
                    alive &= ~(one << k)
                    break
            store(state, at, light)
            store(state, at + SQUARE, red)
            store(state, at + 2 * SQUARE, green)
            store(state, at + 3 * SQUARE, blue)
            if with_depth:
                store(depths, k * SQUARE, deep)
    return alive, fragments


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
    store(state, at, after)
    for c in range(at + SQUARE, at + STATE, SQUARE):
        store(state, c, load(state, c, SQUARE) + scale * load(sums, c, SQUARE))
    if with_depth:
        fallen = (before > _HALF) & (after <= _HALF)
        old = load(depths, k * SQUARE, SQUARE)
        store(depths, k * SQUARE, select(fallen, far[k], old))
    bright: bool = any_(after > cut)
    return bright


@njit(cache=True, nogil=True, error_model="numpy")
def _sum_sheets(
    records: F32, boxes: I32, items: I32, left: int, top: int, sheets_of: F32,
    cut: Real, limits: F32, with_depth: bool, deal: Any,
    sums: F32, sheets: I32, far: F32, state: F32, depths: F32, alive: Any,
) -> Any:  # fmt: skip
    """Do as the scalar twin, square by square."""
    low, scale, thickness = sheets_of[0], sheets_of[1], sheets_of[2]
    sums[:] = 0
    sheets[:] = -1
    words, offsets, shares, sheet_of = deal
    limited = limits.size > 0
    one = np.int64(1)
    zero = full(_ZERO, SQUARE)
    fragments = 0
    for first in range(0, items.shape[0], DEAL):
        if alive == 0:
            break
        touched, halves = deal_splats(
            records, boxes, items, first, min(DEAL, items.shape[0] - first), left, top,
            alive, False, sheets_of, deal,
        )  # fmt: skip
        while touched != 0:
            k = lowest(touched)
            touched &= touched - one
            at = k * STATE
            depth = load(sums, at, SQUARE)
            red = load(sums, at + SQUARE, SQUARE)
            green = load(sums, at + 2 * SQUARE, SQUARE)
            blue = load(sums, at + 3 * SQUARE, SQUARE)
            bound = load(limits, k * SQUARE, SQUARE) if limited else depth
            u = f32((lanes(SQUARE) & 3) + np.int32(left + (k & 7) * SIDE)) + _HALF
            v = f32((lanes(SQUARE) >> 2) + np.int32(top + (k >> 3) * SIDE)) + _HALF
            last = np.float32(sheets[k])
            half = 0
            those = words[k]
            while True:
                if those == 0:
                    half += 1
                    if half == halves:
                        break
                    those = words[half * SQUARES + k]
                    continue
                m = half * SQUARES + lowest(those)
                those &= those - one
                o = offsets[m]
                sheet = sheet_of[m]
                if sheet != last:
                    store(sums, at, depth)
                    store(sums, at + SQUARE, red)
                    store(sums, at + 2 * SQUARE, green)
                    store(sums, at + 3 * SQUARE, blue)
                    bright = _end_sheet(k, sums, cut, with_depth, state, depths, far)
                    depth = zero
                    red = zero
                    green = zero
                    blue = zero
                    last = sheet
                    far[k] = low + (sheet + _HALF) * thickness / scale
                    if not bright:
                        alive &= ~(one << k)
                        break
                fragments += shares[m]
                w = _footprint(records, o, u, v) * records[o + 5]
                if limited:
                    w = select(bound > records[o + 6], w, _ZERO)
                depth = depth + w
                red = red + w * records[o + 8]
                green = green + w * records[o + 9]
                blue = blue + w * records[o + 10]
            sheets[k] = np.int32(last)
            store(sums, at, depth)
            store(sums, at + SQUARE, red)
            store(sums, at + 2 * SQUARE, green)
            store(sums, at + 3 * SQUARE, blue)
    for k in range(SQUARES):
        if sheets[k] < 0:
            continue
        if not _end_sheet(k, sums, cut, with_depth, state, depths, far):
            alive &= ~(one << k)
    return alive, fragments


@njit(cache=True, nogil=True, error_model="numpy")
def _list_ahead(records: F32, items: I32, some: int, column: int, turn: int) -> int:
    """List a tile's splats in one of two places; ask for the first ones' records."""
    listed = items[4 + (turn & 1)]
    found = list_tile(items[0], items[1], some, column, listed)
    for m in range(min(found, DEAL)):
        prefetch(records, listed[m] * RECORD)
    return found


@njit(cache=True, nogil=True, error_model="numpy")
def draw_tiles(
    records: F32, boxes: I32, ranges: I32, numbers: I32, count: int, first: int,
    end: int, across: int, points: bool, cut: Real, sheets_of: F32, limit_mm: F32,
    is_new: bool, last: bool, items: I32, limits: F32, sums: F32, sheets: I32, far: F32,
    states: F32, depths: F32, alive: I64, image: F32, depth: F32,
) -> int:  # fmt: skip
    """Do as the scalar twin."""
    fragments = 0
    deal = room_for_deal()
    with_depth = depth.size > 0
    row = first // across
    top = row * TILE_SIDE
    column = first - row * across
    last_column = column + end - first - 1
    some = list_run(
        ranges, numbers, count, row, column, last_column, items[0], items[1]
    )
    ahead = 0
    for t in range(first, end):
        # while a tile is drawn, the first splats of the next come near
        if t == first:
            ahead = _list_ahead(records, items, some, column, 0)
        found, listed = ahead, items[4 + (t - first & 1)]
        column = t - row * across
        if t + 1 < end and (is_new or alive[t + 1] != 0):
            ahead = _list_ahead(records, items, some, column + 1, t + 1 - first)
        if not is_new and alive[t] == 0:
            continue
        left = column * TILE_SIDE
        if is_new:
            height, width = image.shape[0], image.shape[1]
            alive[t] = open_tile(left, top, width, height, states[t])
            depths[t] = np.inf
        limited = limit_mm.size > 0 and limit_tile(limit_mm, left, top, limits)
        bound = limits if limited else limits[:0]
        if sheets_of.size > 0:
            alive[t], pixels = _sum_sheets(
                records, boxes, listed[:found], left, top, sheets_of, cut, bound,
                with_depth, deal, sums, sheets, far, states[t], depths[t], alive[t],
            )  # fmt: skip
        else:
            alive[t], pixels = _blend_splats(
                records, boxes, listed[:found], left, top, points, cut, bound,
                with_depth, deal, states[t], depths[t], alive[t],
            )  # fmt: skip
        fragments += pixels
        if last or alive[t] == 0:
            _close_tile(states[t], depths[t], left, top, with_depth, image, depth)
    return fragments
