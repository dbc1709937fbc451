"""Holes of a splatted picture, and what fills them."""

import math

import numpy as np
from numba import njit

from renderers.fsr.kernels.array_types import F32, I32


@njit(cache=True, nogil=True, error_model="numpy")
def find_holes(
    rays: F32, depth: F32, normal: F32, coverage: F32, enough: int,
    rows: tuple[int, int], columns: tuple[int, int], where: I32, found: F32,
) -> int:  # fmt: skip
    """Find empty pixels of which `enough` of 8 neighbours have any.

    rows, columns: first and past the last that are looked at; the picture's outermost
    are not. where, found: `(m, 2)` positions and `(m, 4)` depths and normals, means of
    the neighbours', large enough for all pixels. Returns the number found.
    """
    height, width = depth.shape
    left = max(columns[0], 1)
    right = min(columns[1], width - 1)
    # of a column's three pixels, how many have any; most empty pixels are open air
    known = np.empty(max(right - left, 0) + 2, np.uint8)
    n = 0
    for y in range(max(rows[0], 1), min(rows[1], height - 1)):
        above, here, below = coverage[y - 1], coverage[y], coverage[y + 1]
        for i in range(known.shape[0]):
            x = i + left - 1
            known[i] = (above[x] > 0) + (here[x] > 0) + np.uint8(below[x] > 0)
        for x in range(left, right):
            i = x - left
            if known[i] + known[i + 1] + known[i + 2] < enough:
                continue
            if here[x] > 0 or rays[y, x, 2] == 0:
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
            if length > 0:
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
