"""What a scope sees at one moment: by rays from the eye, and by rays to it.

The two do not share their way: rays from the eye step by the distance that the field
promises (sphere tracing, Hart 1996); rays from places of the wall take small even steps
and look only at the sign.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from scenarios.coverage.kernels.gather_patches import facing_of, key_of
from surgery.kernels.distance_field import FREE_MM, air_mm

Floats = NDArray[np.float32]
Doubles = NDArray[np.float64]

AT_WALL_MM = 0.05
"""A ray so near to tissue has met it."""

OFF_GRID_MM = 2.0
"""Step through air off the grid, where nothing is known."""

MOST_STEPS = 400


class Air(NamedTuple):
    """The head as it is cut: signed distance, mm, negative in air, and its grid.

    voxel: ``(3, 4)`` voxels from patient mm. slope_mm: half the way over which a
    normal is measured.
    """

    distance: Floats
    voxel: Doubles
    slope_mm: float


class Seeing(NamedTuple):
    """What counts as seen: mm, cosines, and radians per second of the picture.

    frame: ``(4, 3)`` eye, right, up, forward. before: the same so long ago as
    elapsed_s, 0 for unknown.
    """

    frame: Doubles
    before: Doubles
    elapsed_s: float
    nearest_mm: float
    farthest_mm: float
    least_cosine: float
    edge_cosine: float
    fastest_rad_s: float


@njit(cache=True, nogil=True, error_model="numpy")
def add_seen(
    air: Air,
    seeing: Seeing,
    rays: Doubles,
    table: NDArray[np.int32],
    block: NDArray[np.int64],
    blocks: NDArray[np.int64],
    seen_mm2: Doubles,
) -> None:
    """Add the area of wall that rays of the camera stand for to the patches they meet.

    A ray of solid angle w that meets the wall at distance t, at an angle whose cosine
    is c, stands for w t^2 / c of it.

    rays: ``(n, 4)`` unit directions, camera frame, and solid angles. table: patches by
    `key_of`, -1 for none. seen_mm2: ``(patches,)``, added to.
    """
    distance, voxel = air.distance, air.voxel
    frame = seeing.frame
    normal = np.empty(3)
    for n in range(rays.shape[0]):
        ux = rays[n, 0] * frame[1, 0] + rays[n, 1] * frame[2, 0]
        ux += rays[n, 2] * frame[3, 0]
        uy = rays[n, 0] * frame[1, 1] + rays[n, 1] * frame[2, 1]
        uy += rays[n, 2] * frame[3, 1]
        uz = rays[n, 0] * frame[1, 2] + rays[n, 1] * frame[2, 2]
        uz += rays[n, 2] * frame[3, 2]
        way = 0.0
        x, y, z = frame[0, 0], frame[0, 1], frame[0, 2]
        has_met = False
        for _ in range(MOST_STEPS):
            free = air_mm(distance, voxel, x, y, z)
            if free < AT_WALL_MM:
                has_met = True
                break
            way += OFF_GRID_MM if free > FREE_MM else free
            if way > seeing.farthest_mm:
                break
            x = frame[0, 0] + way * ux
            y = frame[0, 1] + way * uy
            z = frame[0, 2] + way * uz
        if not has_met or way < seeing.nearest_mm:
            continue
        if not _wall_normal(air, x, y, z, normal):
            continue
        cosine = -(ux * normal[0] + uy * normal[1] + uz * normal[2])
        if cosine < seeing.least_cosine:
            continue
        if not _is_sharp(seeing, x, y, z):
            continue
        # the rest of the way to the wall: patches are of the wall itself
        free = air_mm(distance, voxel, x, y, z)
        x, y, z = x - free * normal[0], y - free * normal[1], z - free * normal[2]
        at = _voxels(voxel, x, y, z)
        turned = _turned(voxel, normal)
        key = key_of(at, facing_of(turned[0], turned[1], turned[2]), block, blocks)
        if key >= 0 and table[key] >= 0:
            seen_mm2[table[key]] += rays[n, 3] * way * way / cosine


@njit(cache=True, nogil=True, error_model="numpy")
def check_seen(
    air: Air,
    seeing: Seeing,
    places: Doubles,
    normals: Doubles,
    step_mm: float,
    seen: NDArray[np.bool_],
) -> None:
    """Mark places of the wall from which the eye is in sight.

    places, normals: ``(n, 3)`` patient mm, unit into the air. seen: ``(n,)``, set.
    """
    frame = seeing.frame
    for n in range(places.shape[0]):
        # just off the wall, so that the way does not begin in it
        x = places[n, 0] + 2.0 * AT_WALL_MM * normals[n, 0]
        y = places[n, 1] + 2.0 * AT_WALL_MM * normals[n, 1]
        z = places[n, 2] + 2.0 * AT_WALL_MM * normals[n, 2]
        wx, wy, wz = frame[0, 0] - x, frame[0, 1] - y, frame[0, 2] - z
        length = math.sqrt(wx * wx + wy * wy + wz * wz)
        if not seeing.nearest_mm <= length <= seeing.farthest_mm:
            continue
        wx, wy, wz = wx / length, wy / length, wz / length
        ahead = -(wx * frame[3, 0] + wy * frame[3, 1] + wz * frame[3, 2])
        facing = wx * normals[n, 0] + wy * normals[n, 1] + wz * normals[n, 2]
        if ahead < seeing.edge_cosine or facing < seeing.least_cosine:
            continue
        if not _is_sharp(seeing, x, y, z):
            continue
        count = int(length / step_mm)
        is_free = True
        for m in range(count):
            way = m * step_mm
            place = x + way * wx, y + way * wy, z + way * wz
            if air_mm(air.distance, air.voxel, place[0], place[1], place[2]) < 0.0:
                is_free = False
                break
        if is_free:
            seen[n] = True


@njit(cache=True, nogil=True, error_model="numpy")
def _wall_normal(air: Air, x: float, y: float, z: float, normal: Doubles) -> bool:
    """Write the unit direction into the air; False where there is none."""
    distance, voxel, h = air.distance, air.voxel, air.slope_mm
    normal[0] = air_mm(distance, voxel, x + h, y, z)
    normal[0] -= air_mm(distance, voxel, x - h, y, z)
    normal[1] = air_mm(distance, voxel, x, y + h, z)
    normal[1] -= air_mm(distance, voxel, x, y - h, z)
    normal[2] = air_mm(distance, voxel, x, y, z + h)
    normal[2] -= air_mm(distance, voxel, x, y, z - h)
    length = math.sqrt(normal[0] ** 2 + normal[1] ** 2 + normal[2] ** 2)
    # an edge of the grid looks like a cliff
    if not 0.0 < length < FREE_MM:
        return False
    for c in range(3):
        normal[c] /= length
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def _is_sharp(seeing: Seeing, x: float, y: float, z: float) -> bool:
    """Return whether a place moved slowly enough through the picture."""
    if not seeing.elapsed_s > 0.0:
        return True
    now, before = seeing.frame, seeing.before
    a, b = np.empty(3), np.empty(3)
    for frame, seen in ((now, a), (before, b)):
        wx, wy, wz = x - frame[0, 0], y - frame[0, 1], z - frame[0, 2]
        length = math.sqrt(wx * wx + wy * wy + wz * wz)
        if not length > 0.0:
            return False
        for c in range(3):
            along = wx * frame[1 + c, 0] + wy * frame[1 + c, 1] + wz * frame[1 + c, 2]
            seen[c] = along / length
    square = (a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2 + (a[2] - b[2]) ** 2
    is_sharp: bool = square <= (seeing.fastest_rad_s * seeing.elapsed_s) ** 2
    return is_sharp


@njit(cache=True, nogil=True, error_model="numpy")
def _voxels(voxel: Doubles, x: float, y: float, z: float) -> tuple[float, float, float]:
    return (
        voxel[0, 0] * x + voxel[0, 1] * y + voxel[0, 2] * z + voxel[0, 3],
        voxel[1, 0] * x + voxel[1, 1] * y + voxel[1, 2] * z + voxel[1, 3],
        voxel[2, 0] * x + voxel[2, 1] * y + voxel[2, 2] * z + voxel[2, 3],
    )


@njit(cache=True, nogil=True, error_model="numpy")
def _turned(voxel: Doubles, normal: Doubles) -> tuple[float, float, float]:
    """Return a direction along the grid's axes, mm."""
    x, y, z = normal[0], normal[1], normal[2]
    found = np.empty(3)
    for c in range(3):
        row = voxel[c]
        length = math.sqrt(row[0] ** 2 + row[1] ** 2 + row[2] ** 2)
        found[c] = (row[0] * x + row[1] * y + row[2] * z) / length
    return found[0], found[1], found[2]
