"""The signed distance to air, read between its voxels: one reader for all contacts.

Forces, walls that hold a tool, gaps, jaws and hazards read it here, in one order of
sums, so that a replay finds the same bits whoever asks.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float32]
Doubles = NDArray[np.float64]

FREE_MM = 500.0
"""What is told as air off the grid is more."""

OFF_GRID_MM = 2.0 * FREE_MM
"""What is told as air off the grid: nothing holds there."""

HOLE = 8
"""Columns of the holes: two ends (6), radius, row of the wall that broke."""


class DistanceField(NamedTuple):
    """The tissue that a tool meets.

    distance: float32, mm, negative in air. voxel: ``(3, 4)`` voxels from patient mm.
    h: its spacing, mm. holes: ``(n, HOLE)``, round ones in walls that the tool broke.
    """

    distance: Floats
    voxel: Doubles
    h: float
    holes: Doubles


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def spacing_of(m: Doubles) -> float:
    """Return the spacing along x of a grid, mm, by its ``(3, 4)`` voxels from mm."""
    return 1.0 / math.sqrt(m[0, 0] ** 2 + m[1, 0] ** 2 + m[2, 0] ** 2)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def affine(m: Doubles, x: float, y: float, z: float) -> tuple[float, float, float]:
    """Return a place moved by a ``(3, 4)`` transform, as of voxels from mm."""
    u = m[0, 0] * x + m[0, 1] * y + m[0, 2] * z + m[0, 3]
    v = m[1, 0] * x + m[1, 1] * y + m[1, 2] * z + m[1, 3]
    w = m[2, 0] * x + m[2, 1] * y + m[2, 2] * z + m[2, 3]
    return u, v, w


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def to_voxel_inside(
    shape: tuple[int, int, int], m: Doubles, x: float, y: float, z: float
) -> tuple[float, float, float]:
    """Return the voxel coordinates of the grid's place that is nearest to a place."""
    nz, ny, nx = shape
    u, v, w = affine(m, x, y, z)
    u = min(max(u, 0.0), nx - 1.0)
    v = min(max(v, 0.0), ny - 1.0)
    w = min(max(w, 0.0), nz - 1.0)
    return u, v, w


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def lerp(values: NDArray[Any], u: float, v: float, w: float) -> float:
    """Interpolate trilinearly at voxel coordinates that must be inside."""
    nz, ny, nx = values.shape
    i, j, k = min(int(u), nx - 2), min(int(v), ny - 2), min(int(w), nz - 2)
    u, v, w = u - i, v - j, w - k
    near, far = values[k], values[k + 1]
    a = near[j, i] + u * (near[j, i + 1] - near[j, i])
    b = near[j + 1, i] + u * (near[j + 1, i + 1] - near[j + 1, i])
    c = far[j, i] + u * (far[j, i + 1] - far[j, i])
    d = far[j + 1, i] + u * (far[j + 1, i + 1] - far[j + 1, i])
    p = a + v * (b - a)
    q = c + v * (d - c)
    return float(p + w * (q - p))


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _air(distance: NDArray[Any], m: Doubles, x: float, y: float, z: float) -> float:
    """Return what `air_mm` does, within whoever asks: a tick of force asks often."""
    nz, ny, nx = distance.shape
    u, v, w = affine(m, x, y, z)
    if not (0 <= u <= nx - 1 and 0 <= v <= ny - 1 and 0 <= w <= nz - 1):
        return OFF_GRID_MM
    return -lerp(distance, u, v, w)


@njit(cache=True, nogil=True, error_model="numpy")
def air_mm(
    distance: NDArray[Any], voxel: Doubles, x: float, y: float, z: float
) -> float:
    """Return how far a place is from tissue, mm; off the grid is air.

    voxel: ``(3, 4)`` voxels from patient mm.
    """
    return _air(distance, voxel, x, y, z)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def off_axis(
    capsule: Doubles, x: float, y: float, z: float
) -> tuple[float, float, float]:
    """Return the way from the nearest place of a capsule's axis, ``(3,)`` mm."""
    dx = capsule[3] - capsule[0]
    dy = capsule[4] - capsule[1]
    dz = capsule[5] - capsule[2]
    px, py, pz = x - capsule[0], y - capsule[1], z - capsule[2]
    along = (px * dx + py * dy + pz * dz) / (dx * dx + dy * dy + dz * dz)
    along = min(max(along, 0.0), 1.0)
    return px - along * dx, py - along * dy, pz - along * dz


@njit(cache=True, nogil=True, error_model="numpy")
def free_at(
    distance: Floats, voxel: Doubles, holes: Doubles, x: float, y: float, z: float
) -> float:
    """Return what `free_mm` does; for loops.

    To take an array out of a `DistanceField` costs as much as a look.
    """
    air = _air(distance, voxel, x, y, z)
    for n in range(holes.shape[0]):
        radius = holes[n, 6]
        if air < radius:
            px, py, pz = off_axis(holes[n], x, y, z)
            air = max(air, radius - math.sqrt(px * px + py * py + pz * pz))
    return air


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def free_mm(field: DistanceField, x: float, y: float, z: float) -> float:
    """Return how far a place is from tissue, mm; holes in it are open."""
    return free_at(field.distance, field.voxel, field.holes, x, y, z)


@njit(cache=True, nogil=True, error_model="numpy")
def slope(field: DistanceField, x: float, y: float, z: float, out: Doubles) -> float:
    """Write the way into the air at a place, ``(3,)``; returns its square, 0 for none.

    Central differences over a voxel of what is interpolated: continuous, and of no
    unit. At the grid's rim there is none to be had.
    """
    distance, voxel, h, holes = field
    total = 0.0
    for c in range(3):
        dx = h if c == 0 else 0.0
        dy = h if c == 1 else 0.0
        dz = h if c == 2 else 0.0
        a = free_at(distance, voxel, holes, x + dx, y + dy, z + dz)
        b = free_at(distance, voxel, holes, x - dx, y - dy, z - dz)
        out[c] = a - b if max(a, b) < FREE_MM else 0.0
        total += out[c] * out[c]
    return total if total >= 1e-12 else 0.0
