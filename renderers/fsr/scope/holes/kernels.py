"""Compiled: holes of a splatted picture, and what fills them."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

F32 = NDArray[np.float32]
I32 = NDArray[np.int32]


@njit(cache=True, nogil=True, error_model="numpy")
def find_holes(
    rays: F32, depth: F32, normal: F32, coverage: F32, enough: int,
    rows: tuple[int, int], columns: tuple[int, int], where: I32, found: F32,
) -> int:  # fmt: skip
    """Find empty pixels of which `enough` of 8 neighbours have any.

    rows, columns: first and past the last that are looked at; the picture's outermost
    are not. where, found: `(m, 2)` positions and `(m, 4)` depths and normals, means of
    the neighbours', with room for all pixels. Returns the number found.
    """
    height, width = depth.shape
    n = 0
    for y in range(max(rows[0], 1), min(rows[1], height - 1)):
        for x in range(max(columns[0], 1), min(columns[1], width - 1)):
            if coverage[y, x] > 0 or rays[y, x, 2] == 0:
                continue
            count = 0
            t = 0.0
            nx = 0.0
            ny = 0.0
            nz = 0.0
            for b in range(y - 1, y + 2):
                for a in range(x - 1, x + 2):
                    if coverage[b, a] > 0:
                        count += 1
                        t += depth[b, a]
                        nx += normal[b, a, 0]
                        ny += normal[b, a, 1]
                        nz += normal[b, a, 2]
            length = math.sqrt(nx * nx + ny * ny + nz * nz)
            if count >= enough and length > 0:
                where[n, 0] = y
                where[n, 1] = x
                found[n, 0] = t / count
                found[n, 1] = nx / length
                found[n, 2] = ny / length
                found[n, 3] = nz / length
                n += 1
    return n


@njit(cache=True, nogil=True, error_model="numpy")
def close_holes(
    where: I32, found: F32, count: int, depth: F32, normal: F32, coverage: F32
) -> None:
    """Write what `find_holes` found."""
    for m in range(count):
        y = where[m, 0]
        x = where[m, 1]
        depth[y, x] = found[m, 0]
        for c in range(3):
            normal[y, x, c] = found[m, c + 1]
        coverage[y, x] = 1
