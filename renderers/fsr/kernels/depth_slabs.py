"""Depth slabs: the elements of clipped rows between two distances from the eye.

A row's own nearest and farthest distance tell whether a slab meets it at all. Depths
are found to the bit as projection finds them, so that no splat changes its slab.
Elements that could only show in finished blocks of pixels are left out.
"""

import numpy as np
from numba import njit

from renderers.fsr.kernels.array_types import I32, I64, U16, Real
from renderers.fsr.kernels.clip_rows import Rows
from renderers.fsr.kernels.depth_sort import KEYS
from renderers.fsr.kernels.footprint import ANTIALIAS, CUT
from renderers.fsr.kernels.project_splats import polar_angle
from renderers.fsr.kernels.tile_buffer import ACROSS, BLOCKS, TILE_SIDE
from renderers.fsr.kernels.view_planes import (
    EQUIDISTANT,
    ORTHOGRAPHIC,
    PERSPECTIVE,
    GridView,
)
from renderers.simd import (
    any_,
    bits,
    count,
    f32,
    full,
    gather,
    i32,
    lanes,
    load,
    maximum,
    minimum,
    select,
    sqrt,
    store_packed,
)
from renderers.simd import lowest as lowest_bit

SPAN = 4
"""Blocks that a footprint may meet along an axis and still be found hidden."""
FIRST_BLOCK = 3 | 3 << ACROSS
"""A tile's squares that are its first block, as bits."""
ROW_BITS = (1 << SPAN) - 1
_W = 16
_ONE = np.float32(1)
_ZERO = np.float32(0)
_TILE = BLOCKS.bit_length() - 1
_BEFORE = BLOCKS - 1
"""Blocks that make the one beyond the picture a tile of its own."""
_LEAST_REACH = np.float32(CUT**2 * ANTIALIAS)
"""Squared pixels that a footprint without size reaches."""
_ROUNDED_PX = np.float32(0.05)
"""Pixels by which places found here may differ from those of projection."""


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _gather_sets(waiting: I32) -> None:
    """Turn zeros and ones of blocks into sets, see `find_waiting`."""
    down, wide = waiting.shape
    for b in range(down):
        # a row from its end: bit r tells of the blocks up to r to the right
        found = 0
        for a in range(wide - 1, -1, -1):
            found = ROW_BITS if waiting[b, a] else (found << 1) & ROW_BITS
            waiting[b, a] = found
    for b in range(down):
        for a in range(wide):
            found = waiting[b, a]
            for d in range(1, SPAN):
                below = waiting[b + d, a] if b + d < down else 0
                found |= (found >> SPAN * (d - 1) | below) << SPAN * d
            waiting[b, a] = found


@njit(cache=True, nogil=True, error_model="numpy")
def find_waiting(alive: I64, down: int, across: int, waiting: I32) -> None:
    """Tell where a picture takes light, in blocks of two by two squares and in tiles.

    alive: ``(down * across,)`` squares that do, by tile. waiting: ``(BLOCKS down + 2,
    BLOCKS across + 2)`` blocks, with one beyond the picture on each side, then ``(down
    + 2, across + 2)`` tiles. Bit r + SPAN d tells whether any up to r to the right and
    d below does.
    """
    high, wide = BLOCKS * down + 2, BLOCKS * across + 2
    waiting[:] = 0
    blocks = waiting[: high * wide].reshape(high, wide)
    tiles = waiting[high * wide :].reshape(down + 2, across + 2)
    for tile in range(down * across):
        b, a = tile // across, tile % across
        if alive[tile] == 0:
            continue
        tiles[b + 1, a + 1] = 1
        for block in range(BLOCKS * BLOCKS):
            d, r = block // BLOCKS, block % BLOCKS
            if (alive[tile] >> 2 * (d * ACROSS + r)) & FIRST_BLOCK:
                blocks[b * BLOCKS + d + 1, a * BLOCKS + r + 1] = 1
    _gather_sets(blocks)
    _gather_sets(tiles)


@njit(cache=True, nogil=True, error_model="numpy")
def select_slab(
    spans: I32, lowest: U16, highest: U16, rows: Rows, view: GridView, reach_mm: Real,
    first_key: int, end_key: int, waiting: I32, index: I32, keys: I32,
) -> int:  # fmt: skip
    """List elements of spans whose key is one of first_key..end_key - 1, and the keys.

    spans, lowest, highest: see `CulledSplats`; near elements are left out. reach_mm:
    radius of an element. waiting: see `find_waiting`; no elements where all take light.
    Those that only finished blocks could show are left out. Returns the number listed;
    index and keys have sixteen to spare.
    """
    columns, ny = rows.columns, rows.per_slice
    base, m, projection, lens = view.base, view.matrix, view.projection, view.scale
    low, scale, near_mm = view.low, view.keys_per_mm, view.near_mm
    width, height = view.width, view.height
    n = 0
    flat = projection == ORTHOGRAPHIC
    blocks_across = (width + TILE_SIDE - 1) // TILE_SIDE * BLOCKS
    blocks_down = (height + TILE_SIDE - 1) // TILE_SIDE * BLOCKS
    stride = np.int32(blocks_across + 2)
    tile_stride = np.int32(blocks_across // BLOCKS + 2)
    tiles = np.int32((blocks_across + 2) * (blocks_down + 2))
    across = np.float32(blocks_across + 1)
    down = np.float32(blocks_down + 1)
    block = np.float32(BLOCKS / TILE_SIDE)
    middle_u = np.float32(0.5 * width)
    middle_v = np.float32(0.5 * height)
    many = spans.shape[0]
    for beginning in range(0, many, _W):
        in_slab = lanes(_W) < many - beginning
        in_slab &= load(highest, beginning, _W) >= np.int32(first_key)
        in_slab &= load(lowest, beginning, _W) < np.int32(end_key)
        rest = bits(in_slab)
        while rest != 0:
            span = beginning + lowest_bit(rest)
            rest &= rest - np.int64(1)
            row, first, end = spans[span, 0], spans[span, 1], spans[span, 2]
            k = np.uint32(row) // np.uint32(ny)
            dy = np.float32(np.uint32(row) - k * np.uint32(ny)) - base[1]
            dz = np.float32(k) - base[2]
            for s in range(first, end, _W):
                met = lanes(_W) < end - s
                dx = f32(load(columns, s, _W)) - base[0]
                z = dx * m[2, 0] + dy * m[2, 1] + dz * m[2, 2] + m[2, 3]
                x = dx * m[0, 0] + dy * m[0, 1] + dz * m[0, 2] + m[0, 3]
                y = dx * m[1, 0] + dy * m[1, 1] + dz * m[1, 2] + m[1, 3]
                rho2 = x * x + y * y
                distance = sqrt(rho2 + z * z)
                depth = z if flat else distance
                step = minimum(
                    maximum((depth - low) * scale, _ZERO), np.float32(KEYS - 1)
                )
                key = i32(step)
                met &= (key >= np.int32(first_key)) & (key < np.int32(end_key))
                met &= ~(depth < near_mm)
                if not any_(met):
                    continue
                if waiting.size > 0:
                    if projection == EQUIDISTANT:
                        rho = sqrt(rho2)
                        tangential = (
                            polar_angle(rho, z) * lens / maximum(rho, np.float32(1e-6))
                        )
                        radial = maximum(tangential, lens / distance)
                    elif projection == PERSPECTIVE:
                        met &= z > distance * np.float32(1e-3)
                        inverse = _ONE / z
                        tangential = inverse * lens
                        radial = tangential * distance * inverse
                    else:
                        tangential = full(lens, _W)
                        radial = tangential
                    u = x * tangential + middle_u
                    v = middle_v - y * tangential
                    reach = radial * reach_mm
                    reach = sqrt(reach * reach + _LEAST_REACH) + _ROUNDED_PX
                    # counted from the block beyond the picture: it stands for all there
                    u = u * block + _ONE
                    v = v * block + _ONE
                    reach = reach * block
                    a0 = i32(minimum(maximum(u - reach, _ZERO), across))
                    a1 = i32(minimum(maximum(u + reach, _ZERO), across))
                    b0 = i32(minimum(maximum(v - reach, _ZERO), down))
                    b1 = i32(minimum(maximum(v + reach, _ZERO), down))
                    wide, high = a1 - a0, b1 - b0
                    place = b0 * stride + a0
                    small = (wide | high) < SPAN
                    if any_(met & ~small):
                        # in tiles what is too large in blocks
                        c0, d0 = (a0 + _BEFORE) >> _TILE, (b0 + _BEFORE) >> _TILE
                        c1, d1 = (a1 + _BEFORE) >> _TILE, (b1 + _BEFORE) >> _TILE
                        place = select(small, place, d0 * tile_stride + c0 + tiles)
                        wide = select(small, wide, c1 - c0)
                        high = select(small, high, d1 - d0)
                        small = (wide | high) < SPAN
                    set_ = wide + high * SPAN
                    some = (gather(waiting, place, met) >> set_) & 1
                    met &= (some != np.int32(0)) | ~small
                store_packed(index, n, lanes(_W) + np.int32(s), met)
                store_packed(keys, n, key, met)
                n += count(met)
    return n
