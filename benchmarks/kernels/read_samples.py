"""The reads of a sample alone, packet after packet: what no march can do without."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.lanes import cell1, cell4, f32, gather_u8, load, rows8, store

F32 = NDArray[np.float32]
I32 = NDArray[np.int32]
I16 = NDArray[np.int16]

WIDTH = 32
"""Lanes, as many as march together."""


@njit(cache=True, nogil=True, error_model="numpy")
def read_values(
    values: I16, corners: I32, parts: F32, row: int, slab: int, out: F32
) -> None:
    """Interpolate one channel at each corner; parts: fractions along x, y, z."""
    n = len(corners)
    for k in range(0, n, WIDTH):
        fx, fy = load(parts, k, WIDTH), load(parts, n + k, WIDTH)
        fz = load(parts, 2 * n + k, WIDTH)
        at = load(corners, k, WIDTH)
        store(out, k, cell1(values, at, row, slab, fx, fy, fz))


@njit(cache=True, nogil=True, error_model="numpy")
def read_gradients(
    quads: I16, corners: I32, parts: F32, row: int, slab: int, out: F32
) -> None:
    """Interpolate four channels at each corner."""
    n = len(corners)
    for k in range(0, n, WIDTH):
        fx, fy = load(parts, k, WIDTH), load(parts, n + k, WIDTH)
        fz = load(parts, 2 * n + k, WIDTH)
        at = load(corners, k, WIDTH)
        v, x, y, z = cell4(quads, at, row, slab, fx, fy, fz)
        store(out, k, v + x + y + z)


@njit(cache=True, nogil=True, error_model="numpy")
def read_lines(lines: F32, bins: I32, out: F32) -> None:
    """Read a bin of a classification for each lane."""
    for k in range(0, len(bins), WIDTH):
        a, b, c, d, e, f, g, h = rows8(lines, load(bins, k, WIDTH))
        store(out, k, a + b + c + d + e + f + g + h)


@njit(cache=True, nogil=True, error_model="numpy")
def read_distances(distances: NDArray[np.uint8], cubes: I32, out: F32) -> None:
    """Read how far it is to something for each lane."""
    for k in range(0, len(cubes), WIDTH):
        at = load(cubes, k, WIDTH)
        store(out, k, f32(gather_u8(distances, at, at >= 0)))
