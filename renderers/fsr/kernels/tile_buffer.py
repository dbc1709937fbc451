"""The tile buffer: tiles of a picture while splats are composited into them.

A tile is cut into squares of 4 x 4 pixels, row by row. A square is one vector: the
light still to come and the three colours of its pixels are four cache lines. A set of
a tile's squares is one number of 64 bits.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from renderers.fsr.kernels.array_types import F32, I32, I64, Flags, Lanes
from renderers.simd import full, load, store_groups, store_quads
from renderers.simd.atomics import fetch_add

TILE_SHIFT = 5
TILE_SIDE = 1 << TILE_SHIFT
SIDE = 4
"""Pixels along a side of a square."""
SQUARE = SIDE * SIDE
ACROSS = TILE_SIDE // SIDE
"""Squares along a side of a tile."""
SQUARES = ACROSS * ACROSS
BLOCKS = ACROSS // 2
"""Blocks of two by two squares along a side of a tile."""
STATE = 4 * SQUARE
"""Floats of a square: the light still to come, then red, green, blue so far."""
RUN = 16
"""Tiles side by side that one thread draws at a time."""
MOST_TILES = 255
"""Tiles along a side of a picture: a splat's range of them takes four bytes."""
DARK = 1e-20
"""Light that every splat leaves: denormal numbers take a hundred cycles. It is far
below what rounding takes from light that shows."""

_ONE = np.float32(1)
_ZERO = np.float32(0)


class TileBuffer(NamedTuple):
    """The tiles of a picture between one depth slab and the next.

    states: ``(tiles, SQUARES * STATE)``. depths: ``(tiles, SQUARES * SQUARE)``, where
    half of the light is gone, or no columns. alive: ``(tiles,)`` the squares that take
    light, a bit each. drawn: ``(tiles,)`` the squares whose state is written. fresh:
    ``(tiles,)`` tiles without a splat so far. counter: ``(1,)`` atomic counter of the
    runs of tiles. waiting: see `find_waiting`. limits: depth limits of one tile.
    """

    states: F32
    depths: F32
    alive: I64
    drawn: I64
    fresh: Flags
    counter: I64
    waiting: I32
    limits: F32


class Canvas(NamedTuple):
    """A picture being drawn.

    depth: per pixel where the light first falls to one half; no elements where it is
    not wanted. limit_mm: per pixel the depth from which nothing is seen; no elements
    where there is none. least_light: below which a square takes no more splats.
    """

    image: F32
    depth: F32
    limit_mm: F32
    least_light: np.float32


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def limit_tile(limit_mm: F32, left: int, top: int, limits: F32) -> bool:
    """Lay a tile's part of the limits out in squares; True if there is any."""
    found = False
    height, width = limit_mm.shape
    for y in range(top, min(top + TILE_SIDE, height)):
        for x in range(left, min(left + TILE_SIDE, width)):
            k = (y - top) // SIDE * ACROSS + (x - left) // SIDE
            p = (y - top) % SIDE * SIDE + (x - left) % SIDE
            limits[k * SQUARE + p] = limit_mm[y, x]
            found = found or limit_mm[y, x] != np.inf
    return found


@njit(cache=True, nogil=True, error_model="numpy")
def open_tile(left: int, top: int, width: int, height: int, state: F32) -> Lanes:
    """Let all light through where the picture is; return the squares there, as bits."""
    state[:] = 0
    if left + TILE_SIDE <= width and top + TILE_SIDE <= height:
        for k in range(0, SQUARES * STATE, STATE):
            state[k : k + SQUARE] = 1
        return np.int64(-1)
    alive = np.int64(0)
    for k in range(SQUARES):
        x = left + k % ACROSS * SIDE
        y = top + k // ACROSS * SIDE
        if x < width and y < height:
            alive |= np.int64(1) << k
        for p in range(SQUARE):
            ahead = x + p % SIDE < width and y + p // SIDE < height
            state[k * STATE + p] = 1 if ahead else 0
    return alive


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _write_cut_tile(
    state: F32, depths: F32, left: int, top: int, image: F32, depth: F32
) -> None:
    """Write a tile that reaches beyond the picture, pixel by pixel."""
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
            if depth.size > 0:
                depth[y, x] = depths[k * SQUARE + p]


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def write_tile(
    state: F32, depths: F32, left: int, top: int, drawn: Lanes, image: F32, depth: F32
) -> None:
    """Write a tile's part of the picture: premultiplied RGBA, and depth if wanted."""
    height, width = image.shape[0], image.shape[1]
    if left + TILE_SIDE > width or top + TILE_SIDE > height:
        _write_cut_tile(state, depths, left, top, image, depth)
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
        if depth.size > 0:
            store_groups(depth, pixel, width, load(depths, k * SQUARE, SQUARE))


@njit(cache=True, nogil=True, error_model="numpy")
def clear_tile(left: int, top: int, image: F32, depth: F32) -> None:
    """Write a tile that no splat meets."""
    bottom, right = top + TILE_SIDE, left + TILE_SIDE
    image[top:bottom, left:right] = 0
    depth[top:bottom, left:right] = np.inf


@njit(cache=True, nogil=True, error_model="numpy")
def next_run(counter: I64, image: F32, alive: I64) -> tuple[int, int]:
    """Return first and last + 1 of the next tiles to draw, in one row, or no tile.

    counter: atomic, shared by threads; runs below one another follow one another. Runs
    that take no more light are left out.
    """
    across = (image.shape[1] + TILE_SIDE - 1) // TILE_SIDE
    down = (image.shape[0] + TILE_SIDE - 1) // TILE_SIDE
    runs = (across + RUN - 1) // RUN
    while True:
        turn = fetch_add(counter)
        if turn >= down * runs:
            return 0, 0
        column, row = turn // down * RUN, turn % down
        first = row * across + column
        end = min(first + RUN, (row + 1) * across)
        for t in range(first, end):
            if alive[t] != 0:
                return first, end
