"""Profiles of CT numbers across the walls of an airway."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from anatomy.kernels.tables import Doubles, Floats
from renderers.scene.kernels.least_along import value_at

STEP_MM = 0.1
COUNT = 36
"""Places of a profile and the step between them: walls are looked for 3.5 mm deep."""

_SQRT_HALF = 0.7071067811865476


@njit(cache=True, nogil=True, error_model="numpy")
def _sample(values: NDArray[np.generic], x: float, y: float, z: float) -> float:
    """Interpolate trilinearly at voxel coordinates, held inside the grid."""
    nz, ny, nx = values.shape
    x = min(max(x, 0.0), nx - 1.000001)
    y = min(max(y, 0.0), ny - 1.000001)
    z = min(max(z, 0.0), nz - 1.000001)
    return value_at(values, x, y, z)


@njit(cache=True, nogil=True, error_model="numpy")
def _inward(distance: Floats, k: int, j: int, i: int, way: Doubles) -> bool:
    """Write the unit direction away from the nearest air to `way`, z y x.

    Each component is the difference with the neighbour nearer to the air: central
    ones vanish in walls two voxels thick.
    """
    here = distance[k, j, i]
    square = 0.0
    for axis in range(3):
        dk, dj, di = axis == 0, axis == 1, axis == 2
        a = distance[k - dk, j - dj, i - di]
        b = distance[k + dk, j + dj, i + di]
        way[axis] = max(here - min(a, b), 0.0)
        if b < a:
            way[axis] = -way[axis]
        square += way[axis] * way[axis]
    if square <= 0.0:
        return False
    for axis in range(3):
        way[axis] /= math.sqrt(square)
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def edge_slopes(
    ct: NDArray[np.generic], distance: Floats, h: float, out: Floats
) -> int:
    """Write the slopes of CT numbers across the air's surface, per mm; give their
    number."""
    nz, ny, nx = distance.shape
    way = np.empty(3)
    count = 0
    for k in range(1, nz - 1):
        for j in range(1, ny - 1):
            for i in range(1, nx - 1):
                d = distance[k, j, i]
                if not 0.0 <= d < 0.5 * h or count >= out.size:
                    continue
                if not _inward(distance, k, j, i, way):
                    continue
                z = k - d / h * way[0]
                y = j - d / h * way[1]
                x = i - d / h * way[2]
                half = 0.25 / h
                ahead = _sample(
                    ct, x + half * way[2], y + half * way[1], z + half * way[0]
                )
                back = _sample(
                    ct, x - half * way[2], y - half * way[1], z - half * way[0]
                )
                out[count] = (ahead - back) / 0.5
                count += 1
    return count


@njit(cache=True, nogil=True, error_model="numpy")
def wall_profiles(
    ct: NDArray[np.generic],
    distance: Floats,
    h: float,
    blur: float,
    levels: Doubles,
    mucosa: Floats,
    bone: Floats,
) -> None:
    """Estimate mucosa and bone behind each voxel of the surface, mm; NaN elsewhere.

    blur: standard deviation of the scan's edges, mm. levels: CT numbers of air, soft
    tissue and thin bone, and the least excess over soft tissue that is bone. What air
    takes off near the surface is put back as an edge of that blur. The excess, summed,
    gives the bone's thickness whatever the blur; its centre the depth. Where the bone
    is wider than the blur its flanks at half height give both.
    """
    nz, ny, nx = distance.shape
    air, soft, hard, least = levels[0], levels[1], levels[2], levels[3]
    way = np.empty(3)
    excess = np.empty(COUNT)
    depths = np.empty(COUNT)
    for k in range(1, nz - 1):
        for j in range(1, ny - 1):
            for i in range(1, nx - 1):
                d = distance[k, j, i]
                if not 0.0 <= d < h:
                    continue
                if not _inward(distance, k, j, i, way):
                    continue
                count, ridge = COUNT, -1.0
                highest = 0.0
                for n in range(COUNT):
                    t = n * STEP_MM - d
                    z = k + t / h * way[0]
                    y = j + t / h * way[1]
                    x = i + t / h * way[2]
                    excess[n] = _sample(ct, x, y, z) - soft
                    depths[n] = _sample(distance, x, y, z)
                    highest = max(highest, depths[n])
                    if depths[n] < highest - 0.5 * h and depths[n] < 0.7 * n * STEP_MM:
                        # air on the far side: the wall's middle is half-way
                        count = n
                        for back in range(n, COUNT):
                            t = back * STEP_MM - d
                            far = _sample(
                                distance,
                                i + t / h * way[2],
                                j + t / h * way[1],
                                k + t / h * way[0],
                            )
                            if far <= 0.0:
                                ridge = 0.5 * back * STEP_MM
                                break
                        break
                if ridge > 0.0:
                    count = min(int(ridge / STEP_MM) + 1, COUNT)
                peak, place = 0.0, 0
                for n in range(count):
                    t = n * STEP_MM
                    lost = 0.5 * math.erfc(t / blur * _SQRT_HALF)
                    if ridge > 0.0:
                        lost += 0.5 * math.erfc((2.0 * ridge - t) / blur * _SQRT_HALF)
                    excess[n] += lost * (soft - air)
                    # closer than that the edge is known too badly
                    if t >= 0.5 * blur and excess[n] > peak:
                        peak, place = excess[n], n
                if peak < least:
                    mucosa[k, j, i], bone[k, j, i] = 1.0, 0.0
                    continue
                first = place
                while first > 0 and excess[first - 1] > 0.5 * peak:
                    first -= 1
                last = place
                while last < count - 1 and excess[last + 1] > 0.5 * peak:
                    last += 1
                mass, moment = 0.0, 0.0
                begin, end = first, last
                while begin > 0 and excess[begin - 1] > 0.1 * peak:
                    begin -= 1
                while end < count - 1 and excess[end + 1] > 0.1 * peak:
                    end += 1
                for n in range(begin, end + 1):
                    mass += excess[n] * STEP_MM
                    moment += excess[n] * STEP_MM * n * STEP_MM
                width = (last - first) * STEP_MM
                wide = width > 1.3 * 2.355 * blur
                if ridge > 0.0:
                    thick = min(2.0 * mass / (hard - soft), 2.0 * ridge)
                    found = ridge - 0.5 * thick
                    if width > 0.65 * 2.355 * blur + 0.2:
                        found = max(first * STEP_MM, 0.0)
                elif wide or last == count - 1:
                    found = first * STEP_MM
                    thick = width
                else:
                    thick = mass / (hard - soft)
                    found = moment / mass - 0.5 * thick
                mucosa[k, j, i] = max(found, 0.0)
                bone[k, j, i] = thick


@njit(cache=True, nogil=True, error_model="numpy")
def medians(layer: Floats, reach: int) -> Floats:
    """Return the median of what is known within `reach` voxels of each known voxel."""
    nz, ny, nx = layer.shape
    found = np.full_like(layer, np.nan)
    held = np.empty((2 * reach + 1) ** 3, np.float32)
    for z in range(nz):
        for y in range(ny):
            for x in range(nx):
                if not layer[z, y, x] >= 0:
                    continue
                count = 0
                for k in range(max(z - reach, 0), min(z + reach + 1, nz)):
                    for j in range(max(y - reach, 0), min(y + reach + 1, ny)):
                        for i in range(max(x - reach, 0), min(x + reach + 1, nx)):
                            if layer[k, j, i] >= 0:
                                held[count] = layer[k, j, i]
                                count += 1
                found[z, y, x] = np.median(held[:count])
    return found
