"""Depth in thin walls, whose middle lies between the voxels."""

import math

from numba import njit

from anatomy.kernels.tables import Doubles, Floats


@njit(cache=True, nogil=True, error_model="numpy")
def wall_depth(
    distance: Floats, spacing: Doubles, x: float, y: float, z: float, depth: float
) -> float:
    """Raise an interpolated depth to what the planes about the corners allow, mm.

    In the middle of a wall between two airs the distance has a ridge, which trilinear
    interpolation cuts off by up to half a voxel. Each corner of the cell knows its own
    air's plane: its value, with the slope towards the neighbours nearer to the air.
    Their least is the ridge; corners in the air beyond bound it. Where one plane alone
    is near, it is no more than the interpolated value, but for noise, and the greater
    of both is returned.

    spacing: ``(3,)`` x y z, mm. x, y, z: voxels. depth: interpolated there, mm; what
    lies in air or at the border of the grid is left.
    """
    nz, ny, nx = distance.shape
    i, j, k = int(x), int(y), int(z)
    if not depth > 0.0:
        return depth
    if i < 1 or j < 1 or k < 1 or i > nx - 3 or j > ny - 3 or k > nz - 3:
        return depth
    least = math.inf
    for corner in range(8):
        u, v, w = i + (corner & 1), j + (corner >> 1 & 1), k + (corner >> 2)
        middle = distance[w, v, u]
        plane = float(middle)
        for axis in range(3):
            a, b, c = axis == 0, axis == 1, axis == 2
            before = distance[w - c, v - b, u - a]
            after = distance[w + c, v + b, u + a]
            # in air the surface lies towards the greater neighbour
            if middle > 0.0:
                slope, rises = middle - min(before, after), before <= after
            else:
                slope, rises = max(before, after) - middle, after >= before
            if slope <= 0.0:
                continue
            slope = min(slope, spacing[axis])
            off = x - u if a else (y - v if b else z - w)
            plane += slope * off if rises else -slope * off
        least = min(least, plane)
    return max(depth, least)


@njit(cache=True, nogil=True, error_model="numpy")
def wall_depths(
    distance: Floats, voxels: Doubles, spacing: Doubles, depth: Doubles
) -> None:
    """Raise depths ``(n,)`` at voxels ``(n, 3)`` in place; see `wall_depth`."""
    for n in range(len(voxels)):
        x, y, z = voxels[n, 0], voxels[n, 1], voxels[n, 2]
        depth[n] = wall_depth(distance, spacing, x, y, z, depth[n])
