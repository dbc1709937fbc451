"""The nearest approach of a straight shaft to a hazard."""

import math

from numba import njit

from anatomy.kernels.tables import Doubles, Shorts


@njit(cache=True, nogil=True, error_model="numpy")
def least_along(
    values: Shorts, start: Doubles, step: Doubles, count: int, far: float
) -> float:
    """Return the least of `count` values at ``start + i * step``, trilinear.

    values: ``(nz, ny, nx)``. start, step: voxel coordinates x, y, z. far: value
    outside the grid.
    """
    nz, ny, nx = values.shape
    least = math.inf
    for n in range(count):
        x = start[0] + n * step[0]
        y = start[1] + n * step[1]
        z = start[2] + n * step[2]
        found = far
        if 0 <= x <= nx - 1 and 0 <= y <= ny - 1 and 0 <= z <= nz - 1:
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
        least = min(least, found)
    return least
