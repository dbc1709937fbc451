"""Gather the zero surface of a distance field into small patches.

The area of a level set is the integral of delta(d) |grad d| over the volume, with a
cosine for delta that is three voxels wide (Engquist, Tornberg and Tsai, Journal of
Computational Physics 207, 2005).
"""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float32]
Doubles = NDArray[np.float64]

BAND = 1.5
"""Half width of the cosine, voxels."""

FACINGS = 6
"""Ways that a patch may face: along an axis of the grid, to either side."""


@njit(cache=True, nogil=True, error_model="numpy")
def facing_of(x: float, y: float, z: float) -> int:
    """Return 0 to 5 for the axis nearest to a direction: -x, +x, -y, +y, -z, +z."""
    if abs(x) >= abs(y) and abs(x) >= abs(z):
        return 1 if x > 0.0 else 0
    if abs(y) >= abs(z):
        return 3 if y > 0.0 else 2
    return 5 if z > 0.0 else 4


@njit(cache=True, nogil=True, error_model="numpy")
def key_of(
    at: tuple[float, float, float],
    facing: int,
    block: NDArray[np.int64],
    blocks: NDArray[np.int64],
) -> int:
    """Return the place in a table of blocks and facings; -1 off it.

    at: voxels x, y, z. block, blocks: ``(3,)`` voxels of a block, and how many.
    """
    i = math.floor((at[0] + 0.5) / block[0])
    j = math.floor((at[1] + 0.5) / block[1])
    k = math.floor((at[2] + 0.5) / block[2])
    if not (0 <= i < blocks[0] and 0 <= j < blocks[1] and 0 <= k < blocks[2]):
        return -1
    key: int = FACINGS * ((k * blocks[1] + j) * blocks[0] + i) + facing
    return key


@njit(cache=True, nogil=True, error_model="numpy")
def gather_patches(
    distance: Floats,
    reached: NDArray[np.bool_],
    spacing: Doubles,
    block: NDArray[np.int64],
    blocks: NDArray[np.int64],
    area: Doubles,
    sums: Doubles,
) -> None:
    """Add the surface to a table of patches.

    distance: signed, mm, negative in air. reached: of its shape, True in air that
    counts. spacing: ``(3,)`` mm. area: ``(keys,)`` mm2. sums: ``(keys, 6)`` places in
    voxels and unit directions into the air, times area; empty for none.
    """
    nz, ny, nx = distance.shape
    band = BAND * min(spacing[0], spacing[1], spacing[2])
    cell = spacing[0] * spacing[1] * spacing[2]
    has_sums = len(sums) > 0
    for k in range(1, nz - 1):
        for j in range(1, ny - 1):
            for i in range(1, nx - 1):
                d = float(distance[k, j, i])
                if not abs(d) < band:
                    continue
                gx = (distance[k, j, i + 1] - distance[k, j, i - 1]) / (2 * spacing[0])
                gy = (distance[k, j + 1, i] - distance[k, j - 1, i]) / (2 * spacing[1])
                gz = (distance[k + 1, j, i] - distance[k - 1, j, i]) / (2 * spacing[2])
                slope = math.sqrt(gx * gx + gy * gy + gz * gz)
                if slope < 0.2:
                    # the middle of a wall or a gap: no surface runs here
                    continue
                ux, uy, uz = -gx / slope, -gy / slope, -gz / slope
                x = i + ux * d / spacing[0]
                y = j + uy * d / spacing[1]
                z = k + uz * d / spacing[2]
                if not _is_reached(reached, spacing, (x, y, z), (ux, uy, uz)):
                    continue
                key = key_of((x, y, z), facing_of(ux, uy, uz), block, blocks)
                if key < 0:
                    continue
                part = cell * slope * (1.0 + math.cos(math.pi * d / band)) / (2 * band)
                area[key] += part
                if has_sums:
                    sums[key, 0] += part * x
                    sums[key, 1] += part * y
                    sums[key, 2] += part * z
                    sums[key, 3] += part * ux
                    sums[key, 4] += part * uy
                    sums[key, 5] += part * uz


@njit(cache=True, nogil=True, error_model="numpy")
def _is_reached(
    reached: NDArray[np.bool_],
    spacing: Doubles,
    at: tuple[float, float, float],
    into: tuple[float, float, float],
) -> bool:
    """Return whether the air in front of a place counts; within a voxel or so."""
    step = max(spacing[0], spacing[1], spacing[2])
    for n in range(1, 4):
        ahead = 0.5 * n * step
        i = round(at[0] + ahead * into[0] / spacing[0])
        j = round(at[1] + ahead * into[1] / spacing[1])
        k = round(at[2] + ahead * into[2] / spacing[2])
        nz, ny, nx = reached.shape
        if 0 <= i < nx and 0 <= j < ny and 0 <= k < nz and reached[k, j, i]:
            return True
    return False
