"""Shells of elements taken sixteen at a time; the method is told in the scalar twin.

Here, elements that could only show in finished tiles are left out.
"""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.fsr.classic.ordering.kernels import KEYS
from renderers.fsr.classic.projection.kernels import ANTIALIAS, CUT
from renderers.fsr.classic.projection.vector.kernels import polar_angle
from renderers.fsr.classic.tiles import TILE_SIDE
from renderers.simd import (
    any_,
    count,
    floor,
    full,
    gather,
    i32,
    lanes,
    load_where,
    maximum,
    minimum,
    sqrt,
    store_packed,
)

F32 = NDArray[np.float32]
I32 = NDArray[np.int32]
Real = float | np.float32

_W = 16
_ONE = np.float32(1)
_ZERO = np.float32(0)

_LEAST_REACH = np.float32(CUT * math.sqrt(ANTIALIAS) + 1.0)
"""Pixels that a footprint without size reaches, and one for rounding."""


@njit(cache=True, nogil=True, error_model="numpy")
def take_shell(
    spans: I32, bounds: I32, ny: int, columns: F32, base: F32, matrix: F32,
    projection: int, low: Real, scale: Real, near_mm: Real, first_key: int,
    end_key: int, lens: Real, reach_mm: Real, width: int, height: int, waiting: I32,
    index: I32, keys: I32,
) -> int:  # fmt: skip
    """Do as the scalar twin."""
    n = 0
    m = matrix
    flat = projection == 2
    stride = np.int32((width + TILE_SIDE - 1) // TILE_SIDE + 3)
    across = np.float32((width + TILE_SIDE - 1) // TILE_SIDE)
    down = np.float32((height + TILE_SIDE - 1) // TILE_SIDE)
    tile = np.float32(1 / TILE_SIDE)
    middle_u = np.float32(0.5 * width)
    middle_v = np.float32(0.5 * height)
    for span in range(spans.shape[0]):
        if bounds[span, 1] < first_key or bounds[span, 0] >= end_key:
            continue
        row, first, end = spans[span, 0], spans[span, 1], spans[span, 2]
        dy = np.float32(row % ny) - base[1]
        dz = np.float32(row // ny) - base[2]
        for s in range(first, end, _W):
            met = lanes(_W) < end - s
            dx = load_where(columns, s, met) - base[0]
            z = dx * m[2, 0] + dy * m[2, 1] + dz * m[2, 2] + m[2, 3]
            x = dx * m[0, 0] + dy * m[0, 1] + dz * m[0, 2] + m[0, 3]
            y = dx * m[1, 0] + dy * m[1, 1] + dz * m[1, 2] + m[1, 3]
            rho2 = x * x + y * y
            distance = sqrt(rho2 + z * z)
            depth = z if flat else distance
            step = minimum(maximum((depth - low) * scale, _ZERO), np.float32(KEYS - 1))
            key = i32(step)
            met &= (key >= np.int32(first_key)) & (key < np.int32(end_key))
            met &= ~(depth < near_mm)
            if not any_(met):
                continue
            if waiting.size > 0:
                if projection == 0:
                    rho = sqrt(rho2)
                    turn = polar_angle(rho, z) * lens / maximum(rho, np.float32(1e-6))
                    stretch = maximum(turn, lens / distance)
                elif projection == 1:
                    met &= z > distance * np.float32(1e-3)
                    turn = lens / z
                    stretch = turn * distance / z
                else:
                    turn = full(lens, _W)
                    stretch = turn
                u = x * turn + middle_u
                v = middle_v - y * turn
                reach = stretch * reach_mm + _LEAST_REACH
                # a tile beyond the picture stands for all beyond
                a0 = minimum(maximum(floor((u - reach) * tile), -_ONE), across)
                a1 = minimum(maximum(floor((u + reach) * tile), -_ONE), across)
                b0 = minimum(maximum(floor((v - reach) * tile), -_ONE), down)
                b1 = minimum(maximum(floor((v + reach) * tile), -_ONE), down)
                small = (a1 - a0 <= _ONE) & (b1 - b0 <= _ONE)
                place = i32(b0 + _ONE) * stride + i32(a0 + _ONE)
                set_ = i32(a1 - a0) + (i32(b1 - b0) << 1)
                some = (gather(waiting, place, met) >> set_) & 1
                met &= (some != np.int32(0)) | ~small
            store_packed(index, n, lanes(_W) + np.int32(s), met)
            store_packed(keys, n, key, met)
            n += count(met)
    return n
