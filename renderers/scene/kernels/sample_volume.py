"""Compiled: trilinear interpolation of a few points, in double precision."""

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(cache=True, nogil=True, error_model="numpy")
def interpolate(
    values: NDArray[Any],
    voxels: NDArray[np.float64],
    background: float,
    found: NDArray[np.float64],
) -> None:
    """Write the values ``(n,)`` at voxel coordinates ``(n, 3)``, x first.

    background: of what is off the grid, or not finite.
    """
    nz, ny, nx = values.shape
    for n in range(len(voxels)):
        x, y, z = voxels[n, 0], voxels[n, 1], voxels[n, 2]
        if not (0 <= x <= nx - 1 and 0 <= y <= ny - 1 and 0 <= z <= nz - 1):
            found[n] = background
            continue
        i, j, k = min(int(x), nx - 2), min(int(y), ny - 2), min(int(z), nz - 2)
        fx, fy, fz = x - i, y - j, z - k
        total = 0.0
        for corner in range(8):
            dx, dy, dz = corner & 1, corner >> 1 & 1, corner >> 2
            weight = fx if dx else 1 - fx
            weight *= fy if dy else 1 - fy
            weight *= fz if dz else 1 - fz
            total += weight * values[k + dz, j + dy, i + dx]
        found[n] = total
