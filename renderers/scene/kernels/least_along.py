"""The least value along a line in a field: the smallest gap along a shaft."""

import math
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray


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

    fall: the field changes by at most this from point to point inside the grid, so that
    points that cannot be the least are left out; inf reads all. level: corners x, y, z
    of a box ``(2, 3)``, and the value that the grid has everywhere outside of it.
    """
    nz, ny, nx = values.shape
    lines = len(starts)
    box, outside = level
    where = np.empty(lines, np.int64)
    leasts = np.empty(lines, np.float64)
    for line in range(lines):
        least = math.inf
        at = 0
        n = 0
        while n < count:
            x = starts[line, 0] + n * steps[line, 0]
            y = starts[line, 1] + n * steps[line, 1]
            z = starts[line, 2] + n * steps[line, 2]
            found = far
            skipped = 0
            if not (0 <= x <= nx - 1 and 0 <= y <= ny - 1 and 0 <= z <= nz - 1):
                pass
            elif (
                x < box[0, 0]
                or x > box[1, 0]
                or y < box[0, 1]
                or y > box[1, 1]
                or z < box[0, 2]
                or z > box[1, 2]
            ):
                found = outside
            else:
                found = sign * value_at(values, x, y, z)
                if found > least:
                    skipped = int((found - least) / fall)
            if found < least:
                least = found
                at = n
            n += 1 + skipped
        where[line] = at
        leasts[line] = least
    return where, leasts
