"""The least value along a line in a field: the smallest gap along a shaft."""

import math
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _within(
    start: float, step: float, low: float, high: float, first: int, end: int
) -> tuple[int, int]:
    """Return between which of a line's points all lie that low and high bound.

    first, end: the points that other bounds left, the latter excluded. One point more
    is kept at either side, which is more than rounding makes of it.
    """
    if step == 0.0:
        return (first, end) if low <= start <= high else (end, end)
    enters = (low - start) / step
    leaves = (high - start) / step
    if step < 0.0:
        enters, leaves = leaves, enters
    # beyond any count, and NaN: nothing is known
    if abs(enters) < 1e9:
        first = max(first, math.floor(enters) - 1)
    if abs(leaves) < 1e9:
        end = min(end, math.ceil(leaves) + 2)
    return first, end


@njit(cache=True, nogil=True, error_model="numpy")
def value_at(values: NDArray[Any], x: float, y: float, z: float) -> float:
    """Interpolate ``(nz, ny, nx)`` values trilinearly at voxel coordinates within."""
    nz, ny, nx = values.shape
    i, j, k = min(int(x), nx - 2), min(int(y), ny - 2), min(int(z), nz - 2)
    x -= i
    y -= j
    z -= k
    found = 0.0
    for corner in range(8):
        a, b, c = corner & 1, (corner >> 1) & 1, corner >> 2
        weight = x if a else 1 - x
        weight *= y if b else 1 - y
        weight *= z if c else 1 - z
        found += weight * values[k + c, j + b, i + a]
    return found


@njit(cache=True, nogil=True, error_model="numpy")
def least_along(
    values: NDArray[np.float32] | NDArray[np.int16],
    sign: float,
    start: NDArray[np.float64],
    step: NDArray[np.float64],
    count: int,
    far: float,
) -> tuple[int, float]:
    """Find where along `count` points ``start + i * step`` a field is least; how much.

    values: ``(nz, ny, nx)``, interpolated trilinearly. sign: 1.0, or -1.0 where the
    field is what they fall short of 0: the air in a distance that is negative there.
    start, step: voxel coordinates x, y, z. far: the field outside the grid.
    """
    nz, ny, nx = values.shape
    least = math.inf
    where = 0
    for n in range(count):
        x = start[0] + n * step[0]
        y = start[1] + n * step[1]
        z = start[2] + n * step[2]
        found = far
        if 0 <= x <= nx - 1 and 0 <= y <= ny - 1 and 0 <= z <= nz - 1:
            found = sign * value_at(values, x, y, z)
        if found < least:
            least = found
            where = n
    return where, least


_COARSE = 16
"""Every so many points are read first where that lets others be left out."""


@njit(cache=True, nogil=True, error_model="numpy")
def least_along_each(
    values: NDArray[np.float32] | NDArray[np.int16],
    sign: float,
    starts: NDArray[np.float64],
    steps: NDArray[np.float64],
    count: int,
    far: float,
    fall: float,
    level: tuple[NDArray[np.float64], float],
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Do as `least_along` for many lines ``(n, 3)``; where and how much, ``(n,)``.

    fall: the field changes by less than this from point to point inside the grid, so
    that points that cannot be the least are left out; inf reads all. level: corners x,
    y, z of a box ``(2, 3)``, and the value that the grid has everywhere outside of it.
    """
    nz, ny, nx = values.shape
    lines = len(starts)
    box, outside = level
    x0, x1 = max(box[0, 0], 0.0), min(box[1, 0], nx - 1.0)
    y0, y1 = max(box[0, 1], 0.0), min(box[1, 1], ny - 1.0)
    z0, z1 = max(box[0, 2], 0.0), min(box[1, 2], nz - 1.0)
    around = min(far, outside)
    where = np.empty(lines, np.int64)
    leasts = np.empty(lines, np.float64)
    for line in range(lines):
        sx, sy, sz = starts[line, 0], starts[line, 1], starts[line, 2]
        dx, dy, dz = steps[line, 0], steps[line, 1], steps[line, 2]
        first, end = _within(sx, dx, x0, x1, 0, count)
        first, end = _within(sy, dy, y0, y1, first, end)
        first, end = _within(sz, dz, z0, z1, first, end)
        least = math.inf
        at = 0
        if fall < math.inf:
            for n in range(first, end, _COARSE):
                x, y, z = sx + n * dx, sy + n * dy, sz + n * dz
                if x0 <= x <= x1 and y0 <= y <= y1 and z0 <= z <= z1:
                    found = sign * value_at(values, x, y, z)
                    if found < least:
                        least = found
                        at = n
        n = 0
        while n < count:
            if least < around or (least == around and at <= n):
                # no point outside of the box is less
                n = max(n, first)
                if n >= end:
                    break
            x, y, z = sx + n * dx, sy + n * dy, sz + n * dz
            found = far
            skipped = 0
            if x0 <= x <= x1 and y0 <= y <= y1 and z0 <= z <= z1:
                found = sign * value_at(values, x, y, z)
                if found > least:
                    skipped = int((found - least) / fall)
            elif 0 <= x <= nx - 1 and 0 <= y <= ny - 1 and 0 <= z <= nz - 1:
                found = outside
            if found < least or (found == least and n < at):
                least = found
                at = n
            n += 1 + skipped
        where[line] = at
        leasts[line] = least
    return where, leasts
