"""Splats composited into a tile, near ones first, a square of sixteen pixels at a time.

Front-to-back compositing: at each pixel a splat of opacity a adds ``T a`` of its colour
and leaves ``T (1 - a)`` of the light (Porter and Duff, 1984). A square of pixels where
T has all but gone takes no more splats.
"""

import numpy as np
from numba import njit

from renderers.fsr.kernels.array_types import F32, I32, Lanes
from renderers.fsr.kernels.bin_splats import Bins, bin_splats, make_bins
from renderers.fsr.kernels.depth_sort import list_block, list_entries, list_tile
from renderers.fsr.kernels.footprint import gaussian_falloff
from renderers.fsr.kernels.project_splats import SplatBuffers
from renderers.fsr.kernels.tile_buffer import (
    DARK,
    SIDE,
    SQUARE,
    SQUARES,
    STATE,
    TILE_SIDE,
    Canvas,
    TileBuffer,
    clear_tile,
    limit_tile,
    next_run,
    open_tile,
    write_tile,
)
from renderers.simd import (
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
)

_ONE = np.float32(1)
_ZERO = np.float32(0)
_HALF = np.float32(0.5)
GROUP = 4
"""Tiles along a side of the blocks whose splats are listed first: every list is gone
through as often as it has parts."""


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _add(sums: Lanes, records: F32, at: int, w: Lanes) -> Lanes:
    """Add weighted by a number of a record."""
    return fma(w, spread(records, at, SQUARE), sums)


@njit(cache=True, nogil=True, error_model="numpy")
def _blend_tile(
    records: F32, boxes: I32, items: I32, left: int, top: int, points: bool,
    cut: np.float32, limits: F32, with_depth: bool, bins: Bins, tiles: TileBuffer,
    t: int,
) -> int:  # fmt: skip
    """Blend the splats `items` into tile t; return the fragments.

    limits: of the tile, or no elements.
    """
    words, offsets, shares, _ = bins
    state, depths = tiles.states[t], tiles.depths[t]
    alive, drawn = tiles.alive[t], tiles.drawn[t]
    limited = limits.size > 0
    one = np.int64(1)
    fragments = 0
    first: Lanes = np.int64(0)
    while first < items.shape[0] and alive != 0:
        touched, halves, first = bin_splats(
            records, boxes, items, first, left, top, alive, points, bins
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
                    share = gaussian_falloff(records, o, u, v)
                    w = light * (share * spread(records, o + 5, SQUARE))
                if limited:
                    w = select(bound > spread(records, o + 6, SQUARE), w, _ZERO)
                before = light
                light = light - w + np.float32(DARK)
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
    tiles.alive[t] = alive
    tiles.drawn[t] = drawn
    return fragments


@njit(cache=True, nogil=True, error_model="numpy")
def draw_tiles(
    buffers: SplatBuffers, count: int, points: bool, last: bool, tiles: TileBuffer,
    canvas: Canvas,
) -> int:  # fmt: skip
    """Blend splats into tiles, near ones first; write the tiles that are finished.

    count: of the entries in `buffers`, see `place_by_keys`. last: no more will come.
    tiles: its counter is zero at first; threads that share it share out the tiles.
    Returns the fragments: pixels of the splats' boxes in squares that were drawn, in
    parts of 2 ** `FRAGMENT_BITS`.
    """
    records, boxes = buffers.records.reshape(-1), buffers.boxes
    entries, items = buffers.entries, buffers.items
    alive, fresh, counter = tiles.alive, tiles.fresh, tiles.counter
    image, depth, limit_mm, cut = canvas
    fragments = 0
    bins = make_bins()
    with_depth = depth.size > 0
    height, width = image.shape[0], image.shape[1]
    across = (width + TILE_SIDE - 1) // TILE_SIDE
    listed = items[2]
    band, band_start, many = -GROUP, 0, 0
    while True:
        first, end = next_run(counter, image, alive)
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
                if left + TILE_SIDE <= width and top + TILE_SIDE <= height:
                    # squares are opened one by one, when they are drawn
                    tiles.drawn[t] = 0
                else:
                    tiles.drawn[t] = -1
                    alive[t] = open_tile(left, top, width, height, tiles.states[t])
                tiles.depths[t] = np.inf
            limited = limit_mm.size > 0 and limit_tile(
                limit_mm, left, top, tiles.limits
            )
            fragments += _blend_tile(
                records, boxes, listed[:found], left, top, points, cut,
                tiles.limits if limited else tiles.limits[:0], with_depth, bins, tiles,
                t,
            )  # fmt: skip
            if last or alive[t] == 0:
                write_tile(
                    tiles.states[t], tiles.depths[t], left, top, tiles.drawn[t], image,
                    depth,
                )  # fmt: skip
    return fragments
