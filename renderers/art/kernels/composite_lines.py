"""Compiled: integrate a transfer function along lines through a volume, unlit."""

import math
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.art.cells.brick_views import Classification
from renderers.art.kernels.interpolate_scalar import U
from renderers.art.kernels.segments_scalar import classify, segment


@njit(cache=True, nogil=True, error_model="numpy")
def _across(plane: NDArray[Any], ix: int, iy: int, fx: float, fy: float) -> float:
    """Interpolate between four voxels of a plane."""
    row, next_ = plane[U(iy)], plane[U(iy + 1)]
    a, b = float(row[U(ix)]), float(next_[U(ix)])
    a += (float(row[U(ix + 1)]) - a) * fx
    b += (float(next_[U(ix + 1)]) - b) * fx
    return a + (b - a) * fy


@njit(cache=True, nogil=True, error_model="numpy")
def _density(values: NDArray[Any], x: float, y: float, z: float) -> np.float32:
    """Interpolate between eight voxels, in float64."""
    nz, ny, nx = values.shape
    ix = min(max(int(x), 0), nx - 2)
    iy = min(max(int(y), 0), ny - 2)
    iz = min(max(int(z), 0), nz - 2)
    fx, fy, fz = x - ix, y - iy, z - iz
    near = _across(values[U(iz)], ix, iy, fx, fy)
    return np.float32(near + (_across(values[U(iz + 1)], ix, iy, fx, fy) - near) * fz)


@njit(cache=True, nogil=True, error_model="numpy")
def composite_lines(
    values: NDArray[Any],
    start: NDArray[np.float64],
    way: NDArray[np.float64],
    length_mm: NDArray[np.float64],
    step_mm: float,
    cutoff: float,
    table: Classification,
    sums: NDArray[np.float32],
    found: NDArray[np.float64],
) -> None:
    """Write premultiplied colour and opacity of each line into found (n, 4).

    values: ``(nz, ny, nx)``. start: (n, 3) voxels x y z. way: (n, 3) voxels per mm.
    A line ends when less than `cutoff` of its light is left, or where a density is not
    finite. sums: see `segment`.
    """
    for line in range(len(start)):
        x, y, z = start[line, 0], start[line, 1], start[line, 2]
        count = max(1, math.ceil(length_mm[line] / step_mm))
        h = length_mm[line] / count
        left = 1.0
        for c in range(4):
            found[line, c] = 0.0
        v0 = _density(values, x, y, z)
        if not abs(v0) < np.inf:
            continue
        p0, e0, r0, g0, b0 = classify(table, v0)
        for i in range(1, count + 1):
            s = i * h
            v1 = _density(
                values,
                x + s * way[line, 0],
                y + s * way[line, 1],
                z + s * way[line, 2],
            )
            if not abs(v1) < np.inf:
                break
            p1, e1, r1, g1, b1 = classify(table, v1)
            if p0 == p1 and e0 == e1 == 0:
                v0, r0, g0, b0 = v1, r1, g1, b1
                continue
            alpha, red, green, blue = segment(
                table, sums, np.float32(h),
                v0, p0, e0, r0, g0, b0, v1, p1, e1, r1, g1, b1,
            )  # fmt: skip
            v0, p0, e0, r0, g0, b0 = v1, p1, e1, r1, g1, b1
            if not alpha > 0:
                continue
            weight = left * float(alpha)
            found[line, 0] += weight * red
            found[line, 1] += weight * green
            found[line, 2] += weight * blue
            found[line, 3] += weight
            left -= weight
            if left < cutoff:
                break
