"""Composite a transfer function along straight lines through a volume, unlit.

Lines go through the whole grid in equal steps; a step has what `segments.integrate`
says of the densities at its two ends, `WIDTH` lines at a time. Densities are
interpolated between eight voxels in double precision.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.art.kernels.march_types import F32, F64, Classification
from renderers.art.kernels.opacity import ZERO
from renderers.art.kernels.segments import end_of, integrate
from renderers.simd import full, load, store

WIDTH = 16


class LineArrays(NamedTuple):
    """Lines.

    start: (n, 3) voxels x y z. way: (n, 3) voxels per mm. length_mm: (n,).
    """

    start: F64
    way: F64
    length_mm: F64


@njit(cache=True, nogil=True, error_model="numpy")
def _across(
    plane: NDArray[np.generic], ix: int, iy: int, fx: float, fy: float
) -> float:
    """Interpolate between four voxels of a plane."""
    a, b = float(plane[iy, ix]), float(plane[iy + 1, ix])
    a += (float(plane[iy, ix + 1]) - a) * fx
    b += (float(plane[iy + 1, ix + 1]) - b) * fx
    return a + (b - a) * fy


@njit(cache=True, nogil=True, error_model="numpy")
def _density(values: NDArray[np.generic], x: float, y: float, z: float) -> np.float32:
    """Interpolate between eight voxels of ``(nz, ny, nx)``."""
    nz, ny, nx = values.shape
    ix = min(max(int(x), 0), nx - 2)
    iy = min(max(int(y), 0), ny - 2)
    iz = min(max(int(z), 0), nz - 2)
    fx, fy, fz = x - ix, y - iy, z - iz
    near = _across(values[iz], ix, iy, fx, fy)
    return np.float32(near + (_across(values[iz + 1], ix, iy, fx, fy) - near) * fz)


@njit(cache=True, nogil=True, error_model="numpy")
def composite_lines(
    values: NDArray[np.generic], lines: LineArrays, step_mm: float, cutoff: float,
    table: Classification, sums: F32, found: F64,
) -> None:  # fmt: skip
    """Write premultiplied colour and opacity of each line into found (n, 4).

    values: ``(nz, ny, nx)``. A line is cut into equal steps of `step_mm` at most. It
    ends when less than `cutoff` of its light is left, or where a density is not finite.
    sums: of `sums_at_nodes`.
    """
    start, way, length_mm = lines.start, lines.way, lines.length_mm
    bins = (table.low, table.scale, table.last)
    rows, first, extinction = table.lines, table.first, table.extinction
    color, slope = table.color, table.color_slope
    zero = full(ZERO, WIDTH)
    running, count = np.zeros(WIDTH, np.int32), np.zeros(WIDTH, np.int64)
    density, h = np.zeros(WIDTH, np.float32), np.ones(WIDTH, np.float32)
    light, left = np.zeros((4, WIDTH), np.float32), np.ones(WIDTH)
    found[:] = 0.0
    for base in range(0, len(start), WIDTH):
        for lane in range(WIDTH):
            running[lane], density[lane], left[lane] = 0, ZERO, 1.0
            line = base + lane
            if line >= len(start):
                continue
            x, y, z = start[line]
            v = _density(values, x, y, z)
            if abs(v) < np.inf:
                running[lane], density[lane] = 1, v
                count[lane] = max(1, math.ceil(length_mm[line] / step_mm))
                h[lane] = length_mm[line] / count[lane]
        v0 = load(density, 0, WIDTH)
        on = load(running, 0, WIDTH) != 0
        begin = end_of(rows, first, extinction, color, slope, bins, v0, on)
        step = 0
        while True:
            step += 1
            some = False
            for lane in range(WIDTH):
                if running[lane] == 0:
                    continue
                line = base + lane
                s = step * (length_mm[line] / count[lane])
                v = np.float32(np.nan)
                if step <= count[lane]:
                    v = _density(
                        values,
                        start[line, 0] + s * way[line, 0],
                        start[line, 1] + s * way[line, 1],
                        start[line, 2] + s * way[line, 2],
                    )
                if abs(v) < np.inf:
                    density[lane] = v
                    some = True
                else:
                    running[lane] = 0
            if not some:
                break
            v1 = load(density, 0, WIDTH)
            on = load(running, 0, WIDTH) != 0
            end = end_of(rows, first, extinction, color, slope, bins, v1, on)
            alpha, r, g, b = integrate(
                extinction, color, sums, load(h, 0, WIDTH), on, v0, begin, v1, end, zero
            )
            store(light[0], 0, r)
            store(light[1], 0, g)
            store(light[2], 0, b)
            store(light[3], 0, alpha)
            v0, begin = v1, end
            for lane in range(WIDTH):
                if running[lane] == 0 or not light[3, lane] > 0:
                    continue
                weight = left[lane] * float(light[3, lane])
                line = base + lane
                for c in range(3):
                    found[line, c] += weight * light[c, lane]
                found[line, 3] += weight
                left[lane] -= weight
                if left[lane] < cutoff:
                    running[lane] = 0
