"""The least air around a tool that is made of capsules."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from surgery.kernels.distance_field import FREE_MM, air_mm

Floats = NDArray[np.float32]
Doubles = NDArray[np.float64]


@njit(cache=True, nogil=True, error_model="numpy")
def capsule_gap(
    distance: Floats, voxel: Doubles, capsules: Doubles, step: float, nearest: Doubles
) -> float:
    """Return the least gap between capsules and tissue, mm; write where it is.

    distance: signed, mm, negative in air; off the grid is air. voxel: ``(3, 4)`` voxels
    from patient mm. capsules: ``(n, 7)`` start, end, radius, patient mm. step: between
    looks along an axis; the field changes by 1 mm per mm at most, so the gap is at
    most half a step less than told. nearest: ``(3,)`` on a capsule's axis.

    inf where no capsule is near the grid.
    """
    least = math.inf
    for n in range(capsules.shape[0]):
        length = 0.0
        for c in range(3):
            length += (capsules[n, 3 + c] - capsules[n, c]) ** 2
        length = math.sqrt(length)
        at = 0.0
        while True:
            share = at / length if length > 0.0 else 0.0
            x = capsules[n, 0] + share * (capsules[n, 3] - capsules[n, 0])
            y = capsules[n, 1] + share * (capsules[n, 4] - capsules[n, 1])
            z = capsules[n, 2] + share * (capsules[n, 5] - capsules[n, 2])
            air = air_mm(distance, voxel, x, y, z)
            ahead = step
            if air < FREE_MM:
                gap = air - capsules[n, 6]
                if gap < least:
                    least = gap
                    nearest[0], nearest[1], nearest[2] = x, y, z
                # nothing nearer can lie on the way that this air leaves free
                ahead = max(step, gap - least)
            if at >= length:
                break
            at = min(at + ahead, length)
    return least
