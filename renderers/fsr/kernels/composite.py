"""Splats composited into a tile, near ones first, a square of sixteen pixels at a time.

Front-to-back compositing: at each pixel a splat of opacity a adds ``T a`` of its colour
and leaves ``T (1 - a)`` of the light (Porter and Duff, 1984). A square of pixels where
T has all but gone takes no more splats.
"""

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.fsr.kernels.bin_splats import deal_splats, room_for_deal
from renderers.fsr.kernels.depth_sheets import footprint, sum_sheets
from renderers.fsr.kernels.depth_sort import list_block, list_entries, list_tile
from renderers.fsr.kernels.tile_buffer import (
    DARK,
    clear_tile,
    close_tile,
    limit_tile,
    next_run,
    open_tile,
)
from renderers.fsr.splats.splat_tiles import (
    ACROSS,
    SIDE,
    SQUARE,
    SQUARES,
    STATE,
    TILE_SIDE,
)
from renderers.lanes import (
    any_,
    f32,
    fma,
    full,
    lanes,
    load,
    lowest,
    select,
    spread,
    store,
    store_groups,
    store_quads,
)

F32 = NDArray[np.float32]
I32 = NDArray[np.int32]
I64 = NDArray[np.int64]
Flags = NDArray[np.bool_]
Real = float | np.float32
_ONE = np.float32(1)
_ZERO = np.float32(0)
_HALF = np.float32(0.5)
GROUP = 4
"""Tiles along a side of the blocks whose splats are listed first: every list is gone
through as often as it has parts."""


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _close_tile(
    state: F32, depths: F32, left: int, top: int, drawn: Any, with_depth: bool,
    image: F32, depth: F32,
) -> None:  # fmt: skip
    """Write a tile's part of the picture: premultiplied RGBA, and depth if wanted."""
    height, width = image.shape[0], image.shape[1]
    if left + TILE_SIDE > width or top + TILE_SIDE > height:
        close_tile(state, depths, left, top, with_depth, image, depth)
        return
    for k in range(SQUARES):
        pixel = (top + k // ACROSS * SIDE) * width + left + k % ACROSS * SIDE
        alpha = red = green = blue = full(_ZERO, SQUARE)
        if (drawn >> k) & 1:
            at = k * STATE
            alpha = _ONE - load(state, at, SQUARE)
            red = load(state, at + SQUARE, SQUARE)
            green = load(state, at + 2 * SQUARE, SQUARE)
            blue = load(state, at + 3 * SQUARE, SQUARE)
        store_quads(image, 4 * pixel, 4 * width, red, green, blue, alpha)
        if with_depth:
            store_groups(depth, pixel, width, load(depths, k * SQUARE, SQUARE))


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _weigh(records: F32, o: int, u: Any, v: Any) -> Any:
    """Give the shares of light that a splat takes."""
    return footprint(records, o, u, v) * spread(records, o + 5, SQUARE)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _dim(light: Any, w: Any) -> Any:
    """Take from the light, see `DARK`."""
    return light - w + np.float32(DARK)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _add(sums: Any, records: F32, at: int, w: Any) -> Any:
    """Add weighted by a number of a record."""
    return fma(w, spread(records, at, SQUARE), sums)


@njit(cache=True, nogil=True, error_model="numpy")
def _blend_splats(
    records: F32, boxes: I32, items: I32, left: int, top: int, points: bool, cut: Real,
    limits: F32, with_depth: bool, deal: Any,
    state: F32, depths: F32, alive: Any, drawn: Any,
) -> Any:  # fmt: skip
    """Blend a tile's splats; give the squares live and drawn, and the fragments."""
    words, offsets, shares, _, _ = deal
    limited = limits.size > 0
    one = np.int64(1)
    fragments = 0
    first: Any = np.int64(0)
    while first < items.shape[0] and alive != 0:
        touched, halves, first = deal_splats(
            records, boxes, items, first, left, top, alive, points, limits[:0], deal
        )
        while touched != 0:
            k = lowest(touched)
            touched &= touched - one
            at = k * STATE
            light = full(_ONE, SQUARE)
            red = green = blue = full(_ZERO, SQUARE)
            if (drawn >> k) & 1:
                light = load(state, at, SQUARE)
                red = load(state, at + SQUARE, SQUARE)
                green = load(state, at + 2 * SQUARE, SQUARE)
                blue = load(state, at + 3 * SQUARE, SQUARE)
            drawn |= one << k
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
                those &= those - one
                fragments += shares[m]
                if points:
                    side = spread(records, o + 2, SQUARE)
                    dx = u - spread(records, o, SQUARE)
                    dy = v - spread(records, o + 1, SQUARE)
                    inside = (dx >= -side) & (dx < side)
                    inside &= (dy >= -side) & (dy < side)
                    w = select(inside, light * spread(records, o + 5, SQUARE), _ZERO)
                else:
                    w = light * _weigh(records, o, u, v)
                if limited:
                    w = select(bound > spread(records, o + 6, SQUARE), w, _ZERO)
                before = light
                light = _dim(light, w)
                red = _add(red, records, o + 8, w)
                green = _add(green, records, o + 9, w)
                blue = _add(blue, records, o + 10, w)
                if with_depth:
                    fallen = (before > _HALF) & (light <= _HALF)
                    deep = select(fallen, spread(records, o + 6, SQUARE), deep)
                if not any_(light > cut):
                    alive &= ~(one << k)
                    break
            store(state, at, light)
            store(state, at + SQUARE, red)
            store(state, at + 2 * SQUARE, green)
            store(state, at + 3 * SQUARE, blue)
            if with_depth:
                store(depths, k * SQUARE, deep)
    return alive, drawn, fragments


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
    state. depth: where T first falls to one half; no elements where it is not wanted.
    Returns the fragments: pixels of the splats' boxes in squares that were drawn, in
    parts of 2 ** `FRAGMENT_BITS`.
    """
    fragments = 0
    deal = room_for_deal()
    with_depth = depth.size > 0
    height, width = image.shape[0], image.shape[1]
    across = (width + TILE_SIDE - 1) // TILE_SIDE
    listed = items[2]
    band, band_start, many = -GROUP, 0, 0
    while True:
        first, end = next_run(turns, image, alive)
        if first == end:
            break
        row = first // across
        top = row * TILE_SIDE
        start = first - row * across
        stop = start + end - first - 1
        if row // GROUP != band // GROUP or start != band_start:
            band, band_start = row, start
            below = row // GROUP * GROUP + GROUP - 1
            many = list_entries(
                entries, count, row, below, start, stop, items[6], items[7]
            )
        some = list_block(
            items[7], items[6], many, row, row, start, stop, items[0], items[1]
        )
        few = 0
        for t in range(first, end):
            column = t - row * across
            if (t - first) % GROUP == 0:
                aside = column + GROUP - 1
                few = list_block(
                    items[1], items[0], some, row, row, column, aside, items[4],
                    items[5],
                )  # fmt: skip
            if alive[t] == 0:
                continue
            left = column * TILE_SIDE
            found = list_tile(items[4], items[5], few, column, listed)
            if fresh[t] and found == 0:
                if last:
                    clear_tile(left, top, image, depth)
                continue
            if fresh[t]:
                fresh[t] = False
                is_whole = left + TILE_SIDE <= width and top + TILE_SIDE <= height
                if is_whole and sheets_of.size == 0:
                    # squares are opened one by one, when they are drawn
                    drawn[t] = 0
                else:
                    drawn[t] = -1
                    alive[t] = open_tile(left, top, width, height, states[t])
                depths[t] = np.inf
            limited = limit_mm.size > 0 and limit_tile(limit_mm, left, top, limits)
            bound = limits if limited else limits[:0]
            if sheets_of.size > 0:
                alive[t], pixels = sum_sheets(
                    records, boxes, listed[:found], left, top, sheets_of, cut, bound,
                    with_depth, deal, sums, sheets, far, states[t], depths[t], alive[t],
                )  # fmt: skip
            else:
                alive[t], drawn[t], pixels = _blend_splats(
                    records, boxes, listed[:found], left, top, points, cut, bound,
                    with_depth, deal, states[t], depths[t], alive[t], drawn[t],
                )  # fmt: skip
            fragments += pixels
            if last or alive[t] == 0:
                _close_tile(
                    states[t], depths[t], left, top, drawn[t], with_depth, image, depth
                )
    return fragments
