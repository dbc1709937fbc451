"""Depth in thin walls, whose middle lies between the voxels."""

import math

import numpy as np
from numba import njit

from anatomy.kernels.tables import Doubles, Floats


@njit(cache=True, nogil=True, error_model="numpy")
def wall_depths(
    distance: Floats, voxels: Doubles, spacing: Doubles, depth: Doubles
) -> None:
    """Raise interpolated depths to what the planes about the corners allow, in place.

    In the middle of a wall between two airs the distance has a ridge, which trilinear
    interpolation cuts off by up to half a voxel. Each corner of the cell knows its own
    air's plane: its value, with the slope towards the neighbours nearer to the air.
    Their least is the ridge; corners in the air beyond bound it. Where one plane alone
    is near, it is no more than the interpolated value, but for noise, and the greater
    of both stays.

    voxels: ``(n, 3)`` x y z. spacing: ``(3,)`` x y z, mm. depth: ``(n,)`` mm; what
    lies in air or at the border of the grid is left.
    """
    nz, ny, nx = distance.shape
    here = np.empty(3, np.int64)
    for n in range(len(voxels)):
        if not depth[n] > 0.0:
            continue
        x, y, z = voxels[n, 0], voxels[n, 1], voxels[n, 2]
        i, j, k = int(x), int(y), int(z)
        if i < 1 or j < 1 or k < 1 or i > nx - 3 or j > ny - 3 or k > nz - 3:
            continue
        least = math.inf
        for corner in range(8):
            here[0] = i + (corner & 1)
            here[1] = j + (corner >> 1 & 1)
            here[2] = k + (corner >> 2)
            middle = distance[here[2], here[1], here[0]]
            plane = float(middle)
            for axis in range(3):
                a, b, c = axis == 0, axis == 1, axis == 2
                before = distance[here[2] - c, here[1] - b, here[0] - a]
                after = distance[here[2] + c, here[1] + b, here[0] + a]
                # in air the surface lies towards the greater neighbour
                if middle > 0.0:
                    slope, rises = middle - min(before, after), before <= after
                else:
                    slope, rises = max(before, after) - middle, after >= before
                if slope <= 0.0:
                    continue
                slope = min(slope, spacing[axis])
                off = voxels[n, axis] - here[axis]
                plane += slope * off if rises else -slope * off
            least = min(least, plane)
        depth[n] = max(depth[n], least)
