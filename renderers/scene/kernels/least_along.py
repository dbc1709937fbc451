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
