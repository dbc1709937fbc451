"""Draw blocks of a picture, from its lens to its pixels, taking turns with others.

The rays of a block are set up, march and are delivered before those of the next are
set up, in the same memory, which stays in the nearest caches. A block with rays that
miss a cell stays where it is, and the next ones get memory of their own. Threads take
blocks from either end of the picture, until they meet.
"""

from collections.abc import Callable
from typing import cast

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.art.kernels.find_surface import seek_packets, settle_packets
from renderers.art.kernels.march_packets import march_packets
from renderers.art.kernels.march_types import (
    BLOCK_COLUMNS,
    F32,
    I32,
    TILE_PX,
    BlockMemory,
    CellView,
    Deflectors,
    LensRays,
    PictureArrays,
    RayArrays,
    RaySetUp,
    ShadeSettings,
)
from renderers.art.kernels.set_up_rays import set_up_rays
from renderers.simd import count as count_lanes
from renderers.simd import lanes, load, store
from renderers.simd.atomics import fetch_add

WIDTH = 32
"""Rays of a packet: with and without AVX-512 the fastest of 4 to 64."""

BLOCK = BLOCK_COLUMNS * TILE_PX
"""Rays of a block, at most."""

LIT, UNLIT, INTEGRATED, INTEGRATED_UNLIT, SURFACE = range(5)
"""The marches."""

ABREAST = 16
"""Channels delivered at a time."""

FAR = np.float32(np.inf)
ZERO, ONE = np.float32(0), np.float32(1)

NO_CLOCK = cast(int, np.int64(0))
"""A literal would compile what takes it once more."""

_lit = march_packets(WIDTH, True, False, False)
_unlit = march_packets(WIDTH, False, False, False)
_integrated = march_packets(WIDTH, True, True, False)
_integrated_unlit = march_packets(WIDTH, False, True, False)
_seek = seek_packets(WIDTH, False)
_settle = settle_packets(WIDTH, False)


@njit(cache=True, nogil=True, error_model="numpy")
def list_tiles(columns: int, rows: int, order: I32) -> None:
    """List a block's rays, numbered row by row, tile by tile."""
    n = 0
    for left in range(0, columns, TILE_PX):
        for y in range(rows):
            for x in range(left, min(left + TILE_PX, columns)):
                order[n] = y * columns + x
                n += 1


@njit(cache=True, nogil=True, error_model="numpy")
def fill(row: F32 | I32, number: np.float32 | int) -> None:
    """Write a number everywhere."""
    for k in range(len(row)):
        row[k] = number


@njit(cache=True, nogil=True, error_model="numpy")
def any_waits(cursor: I32) -> bool:
    """Tell whether a ray waits for a cell; cursor: four numbers a ray, in a row."""
    found = np.int32(0)
    for ray in range(len(cursor) // 4):
        found |= cursor[4 * ray + 3]
    return bool(found > 0)


@njit(cache=True, nogil=True, error_model="numpy")
def deliver(
    value: F32, depth: F32, least_left: np.float32,
    seen: F32, far: F32, done: NDArray[np.bool_],
) -> tuple[int, int]:  # fmt: skip
    """Put a row of rays into the picture; all of them have ended.

    Counts the pixels that had none, and the rays of which less than `least_left` is
    left.
    """
    alpha = (lanes(ABREAST) & np.int32(3)) == 3
    some = len(seen) // ABREAST * ABREAST
    fresh, early = 0, 0
    for k in range(0, some, ABREAST):
        four = load(value, k, ABREAST)
        store(seen, k, four)
        early += count_lanes(alpha & (ONE - four < least_left))
    for k in range(some, len(seen)):
        seen[k] = value[k]
        early += k & 3 == 3 and ONE - value[k] < least_left
    # one array after the other: the compiler makes vectors of such loops
    for k in range(len(far)):
        far[k] = depth[k]
    for k in range(len(done)):
        fresh += not done[k]
    for k in range(len(done)):
        done[k] = True
    return fresh, early


def strip_kernel(kind: int) -> Callable[..., tuple[int, int, int]]:
    """Make `draw_blocks` for one of the marches."""

    @njit(cache=True, nogil=True, error_model="numpy")
    def draw_blocks(
        blocks: I32, turns: NDArray[np.int64], most: NDArray[np.int64], from_end: bool,
        lens: LensRays, setup: RaySetUp, memory: BlockMemory, picture: PictureArrays,
        view: CellView, shift: int, shade: ShadeSettings | F32,
        counters: NDArray[np.int64],
    ) -> tuple[int, int, int]:  # fmt: skip
        """Draw block after block; count those kept, pixels now done, rays ended early.

        blocks: (n, 4) left, top, right, bottom pixel. turns: three numbers shared by
        all threads: blocks taken from both ends, from the front and from the end.
        most: that all of them take, and this one. shade: in mode `scope` the spacing.
        """
        waiting, rays = memory.waiting, memory.rays
        wide = lens.limit.shape[1]
        table, reach = lens.table.reshape(-1, 3), lens.limit.reshape(-1)
        seen, far = picture.value.reshape(-1), picture.depth.reshape(-1)
        done = picture.done.reshape(-1)
        straight = Deflectors(np.zeros((0, 9)), 1.0, False)
        order = np.empty(BLOCK, np.int32)
        width, height, kept, fresh, early = 0, 0, 0, 0, 0
        limit, left = most[0], most[1]
        while kept < len(waiting) and left > 0 and fetch_add(turns) < limit:
            left -= 1
            if from_end:
                number = len(blocks) - 1 - fetch_add(turns[2:])
            else:
                number = fetch_add(turns[1:])
            x, y = blocks[number, 0], blocks[number, 1]
            columns, rows = blocks[number, 2] - x, blocks[number, 3] - y
            n = columns * rows
            if columns != width or rows != height:
                width, height = columns, rows
                list_tiles(columns, rows, order)
            first = kept * (BLOCK + 1)
            end = first + n
            block = RayArrays(
                order[:n],
                rays.geometry[first : end + 1],
                rays.samples[first:end],
                rays.cursor[first : end + 1],
                rays.value[first : end + 1],
                rays.carry[first : end + 1],
                rays.depth[first:end],
                rays.front[first : end + 1],
            )
            fill(block.cursor.reshape(-1), 0)
            fill(block.value.reshape(-1), ZERO)
            fill(block.carry.reshape(-1), ZERO)
            fill(block.front.reshape(-1), ZERO)
            fill(block.depth, FAR)
            block.geometry[n] = ZERO
            for k in range(rows):
                row, here = k * columns, (y + k) * wide + x
                set_up_rays(
                    table[here : here + columns], reach[here : here + columns],
                    lens.frame, lens.orthographic, setup.voxel_from_world, setup.last,
                    setup.step_mm, setup.at_ends, block.geometry[row : row + columns],
                    block.samples[row : row + columns],
                )  # fmt: skip
            if kind == LIT:
                _lit(block, view, shift, NO_CLOCK, shade, straight, counters)
            elif kind == UNLIT:
                _unlit(block, view, shift, NO_CLOCK, shade, straight, counters)
            elif kind == INTEGRATED:
                _integrated(block, view, shift, NO_CLOCK, shade, straight, counters)
            elif kind == INTEGRATED_UNLIT:
                _integrated_unlit(
                    block, view, shift, NO_CLOCK, shade, straight, counters
                )
            else:
                _seek(block, view, shift, NO_CLOCK, shade, straight, counters)
                _settle(block, view, shift, NO_CLOCK, shade, straight, counters)
            if any_waits(block.cursor.reshape(-1)[: 4 * n]):
                waiting[kept] = number
                kept += 1
                continue
            values = block.value.reshape(-1)
            for k in range(rows):
                row, here = k * columns, (y + k) * wide + x
                more = deliver(
                    values[4 * row : 4 * (row + columns)],
                    block.depth[row : row + columns],
                    setup.least_left,
                    seen[4 * here : 4 * (here + columns)],
                    far[here : here + columns],
                    done[here : here + columns],
                )
                fresh += more[0]
                early += more[1]
        return kept, fresh, early

    return draw_blocks


draw_lit = strip_kernel(LIT)
draw_unlit = strip_kernel(UNLIT)
draw_integrated = strip_kernel(INTEGRATED)
draw_integrated_unlit = strip_kernel(INTEGRATED_UNLIT)
draw_surface = strip_kernel(SURFACE)
