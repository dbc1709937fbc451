"""Draw blocks of a picture, from its lens to its pixels, taking turns with others.

The rays of a block are set up, march and are delivered before those of the next are
set up, in the same memory, which stays in the nearest caches. A block with rays that
miss a cell stays where it is, and the next ones get memory of their own. Threads take
blocks from either end of the picture, until they meet.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.art.cells.brick_views import BLOCK_COLUMNS, TILE_PX
from renderers.art.kernels.find_surface import seek_packets, settle_packets
from renderers.art.kernels.march_integrated import integrated_packets
from renderers.art.kernels.march_packets import F32, I32, classic_packets
from renderers.art.kernels.set_up_rays import set_up_rays
from renderers.lanes import count as count_lanes
from renderers.lanes import lanes, load, store
from renderers.lanes.atomics import take_turn

WIDTH = 32
"""Rays of a packet: with and without AVX-512 the fastest of 4 to 64."""

BLOCK = BLOCK_COLUMNS * TILE_PX
"""Rays of a block, at most."""

LIT, UNLIT, INTEGRATED, INTEGRATED_UNLIT, SCOPE = range(5)
"""The marches."""

ABREAST = 16
"""Channels delivered at a time."""

FAR = np.float32(np.inf)
ZERO, ONE = np.float32(0), np.float32(1)

FIRST: Any = np.int64(0)
"""A literal would compile what takes it once more."""

_lit = classic_packets(WIDTH, True)
_unlit = classic_packets(WIDTH, False)
_integrated = integrated_packets(WIDTH, True)
_integrated_unlit = integrated_packets(WIDTH, False)
_seek = seek_packets(WIDTH)
_settle = settle_packets(WIDTH)


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
def fill(row: NDArray[Any], number: Any) -> None:
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
        blocks: I32, turns: NDArray[np.int64], limit: int, from_end: bool,
        rays: Any, place: Any, least_left: np.float32, memory: Any, picture: Any,
        rest: Any,
    ) -> tuple[int, int, int]:  # fmt: skip
        """Draw block after block; count those kept, pixels now done, rays ended early.

        blocks: (n, 4) left, top, right, bottom pixel. turns: three numbers shared by
        all threads: blocks taken from both ends, of which no more than `limit` are,
        from the front and from the end. rays: table, limit, frame and
        orthographic of `FrameRays`. place: voxel from world, largest index along x, y,
        z, mm a step, whether samples lie at the ends of steps. least_left: of rays that
        did not end early. memory: which blocks are kept, int32, of which there is room
        for no more, and the arrays of a `RayPacket`, BLOCK
        rays and a spare one a block. picture: value, depth and done of a `Gather`.
        rest: what the march takes beside the rays.
        """
        table, reaches, frame, orthographic = rays
        voxel_from_world, last, step_mm, at_ends = place
        waiting, geometries, counts, cursors, values, carries, depths, fronts = memory
        seen, far, done = picture
        wide = reaches.shape[1]
        lens, reach = table.reshape(-1, 3), reaches.reshape(-1)
        seen, far, done = seen.reshape(-1), far.reshape(-1), done.reshape(-1)
        order = np.empty(BLOCK, np.int32)
        width, height, kept, fresh, early = 0, 0, 0, 0, 0
        while kept < len(waiting) and take_turn(turns) < limit:
            if from_end:
                number = len(blocks) - 1 - take_turn(turns[2:])
            else:
                number = take_turn(turns[1:])
            x, y = blocks[number, 0], blocks[number, 1]
            columns, rows = blocks[number, 2] - x, blocks[number, 3] - y
            n = columns * rows
            if columns != width or rows != height:
                width, height = columns, rows
                list_tiles(columns, rows, order)
            some = order[:n]
            first = kept * (BLOCK + 1)
            end = first + n
            geometry, count = geometries[first : end + 1], counts[first:end]
            cursor, value = cursors[first : end + 1], values[first : end + 1]
            carry, depth = carries[first : end + 1], depths[first:end]
            fill(cursor.reshape(-1), 0)
            fill(value.reshape(-1), ZERO)
            fill(carry.reshape(-1), ZERO)
            fill(depth, FAR)
            geometry[n] = ZERO
            for k in range(rows):
                row, here = k * columns, (y + k) * wide + x
                set_up_rays(
                    lens[here : here + columns], reach[here : here + columns], FIRST,
                    frame, orthographic, voxel_from_world, last, step_mm, at_ends,
                    geometry[row : row + columns], count[row : row + columns],
                )  # fmt: skip
            if kind == LIT:
                _lit(some, geometry, count, cursor, value, carry, depth, *rest)
            elif kind == UNLIT:
                _unlit(some, geometry, count, cursor, value, carry, depth, *rest)
            elif kind == SCOPE:
                _seek(some, geometry, count, cursor, value, carry, depth, *rest)
                _settle(some, geometry, count, cursor, value, carry, depth, *rest)
            else:
                front = fronts[first : end + 1]
                fill(front.reshape(-1), ZERO)
                if kind == INTEGRATED:
                    _integrated(
                        some, geometry, count, cursor, value, carry, depth, front,
                        *rest,
                    )  # fmt: skip
                else:
                    _integrated_unlit(
                        some, geometry, count, cursor, value, carry, depth, front,
                        *rest,
                    )  # fmt: skip
            if any_waits(cursor.reshape(-1)[: 4 * n]):
                waiting[kept] = number
                kept += 1
                continue
            values_ = value.reshape(-1)
            for k in range(rows):
                row, here = k * columns, (y + k) * wide + x
                more = deliver(
                    values_[4 * row : 4 * (row + columns)],
                    depth[row : row + columns],
                    least_left,
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
draw_scope = strip_kernel(SCOPE)
