"""Tiles opened, laid out in squares of pixels, and written to the picture.

How a tile lies in memory is told in `renderers/fsr/splats/splat_tiles.py`.
"""

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.fsr.splats.splat_tiles import (
    ACROSS,
    RUN,
    SIDE,
    SQUARE,
    SQUARES,
    STATE,
    TILE_SIDE,
)
from renderers.lanes.atomics import take_turn

F32 = NDArray[np.float32]
I64 = NDArray[np.int64]

_ONE = np.float32(1)

DARK = 1e-20
"""Light that every splat leaves: the smallest numbers take a hundred cycles. It is far
below what rounding takes from light that shows."""


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def limit_tile(limit_mm: F32, left: int, top: int, limits: F32) -> bool:
    """Lay a tile's part of the limits out in squares; say whether there is any."""
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
def open_tile(left: int, top: int, width: int, height: int, state: F32) -> Any:
    """Let all light through where the picture is; give the squares there, as bits."""
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
def clear_tile(left: int, top: int, image: F32, depth: F32) -> None:
    """Write a tile that no splat meets."""
    bottom, right = top + TILE_SIDE, left + TILE_SIDE
    image[top:bottom, left:right] = 0
    depth[top:bottom, left:right] = np.inf


@njit(cache=True, nogil=True, error_model="numpy")
def next_run(turns: I64, image: F32, alive: I64) -> tuple[int, int]:
    """Give first and last + 1 of the next tiles to draw, in one row, or no tile.

    turns: of the runs of `RUN` tiles, shared by threads; those below one another follow
    one another. Runs that take no more light are left out. See `draw_tiles`.
    """
    across = (image.shape[1] + TILE_SIDE - 1) // TILE_SIDE
    down = (image.shape[0] + TILE_SIDE - 1) // TILE_SIDE
    runs = (across + RUN - 1) // RUN
    while True:
        turn = take_turn(turns)
        if turn >= down * runs:
            return 0, 0
        column, row = turn // down * RUN, turn % down
        first = row * across + column
        end = min(first + RUN, (row + 1) * across)
        for t in range(first, end):
            if alive[t] != 0:
                return first, end
