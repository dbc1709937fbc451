"""The smallest gap along a shaft in a distance field."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(cache=True, nogil=True, error_model="numpy")
def least_air(
    distance: NDArray[np.float32],
    start: NDArray[np.float64],
    step: NDArray[np.float64],
    count: int,
    far: float,
) -> tuple[int, float]:
    """Find which of `count` points start + i * step has least air, and how much.

    distance: ``(nz, ny, nx)``, mm, negative in air, interpolated trilinearly. start,
    step: voxel coordinates x, y, z. far: air outside the grid, mm.
    """
    nz, ny, nx = distance.shape
    least = math.inf
    where = 0
    for n in range(count):
        x = start[0] + n * step[0]
        y = start[1] + n * step[1]
        z = start[2] + n * step[2]
        air = far
        if 0 <= x <= nx - 1 and 0 <= y <= ny - 1 and 0 <= z <= nz - 1:
            i, j, k = min(int(x), nx - 2), min(int(y), ny - 2), min(int(z), nz - 2)
            x -= i
            y -= j
            z -= k
            air = 0.0
            for corner in range(8):
                a, b, c = corner & 1, (corner >> 1) & 1, corner >> 2
                weight = x if a else 1 - x
                weight *= y if b else 1 - y
                weight *= z if c else 1 - z
                air -= weight * distance[k + c, j + b, i + a]
        if air < least:
            least = air
            where = n
    return where, least
