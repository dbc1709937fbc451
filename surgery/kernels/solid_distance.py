"""Signed distance to rounded solids, roughness of torn tissue included."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

Doubles = NDArray[np.float64]

FADE_MM = 1.5
"""Roughness fades out at this distance from a solid's surface, smoothly: the rough
distance keeps the order of the smooth one, so a union of parts is rough like the
whole."""


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _hash(i: int, j: int, k: int, seed: int) -> float:
    """Return a number in -1..1 that a lattice point and a seed decide."""
    n = np.uint32(
        (i * 374761393 + j * 668265263 + k * 2147483647 + seed * 974711) & 0xFFFFFFFF
    )
    n = np.uint32(((n ^ (n >> np.uint32(13))) * np.uint32(1274126177)) & 0xFFFFFFFF)
    n = n ^ (n >> np.uint32(16))
    return float(n & np.uint32(0xFFFF)) / 32767.5 - 1.0


@njit(cache=True, nogil=True, error_model="numpy")
def noise(x: float, y: float, z: float, seed: int) -> float:
    """Interpolate lattice noise smoothly, -1..1; one unit is one cell."""
    i, j, k = math.floor(x), math.floor(y), math.floor(z)
    fx, fy, fz = x - i, y - j, z - k
    fx, fy, fz = (
        fx * fx * (3 - 2 * fx),
        fy * fy * (3 - 2 * fy),
        fz * fz * (3 - 2 * fz),
    )
    total = 0.0
    for corner in range(8):
        a, b, c = corner & 1, corner >> 1 & 1, corner >> 2
        weight = (fx if a else 1 - fx) * (fy if b else 1 - fy) * (fz if c else 1 - fz)
        total += weight * _hash(int(i) + a, int(j) + b, int(k) + c, seed)
    return total


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _to_segment(x: float, y: float, z: float, s: Doubles) -> float:
    """Return the distance to the segment whose ends are six numbers."""
    dx, dy, dz = s[3] - s[0], s[4] - s[1], s[5] - s[2]
    px, py, pz = x - s[0], y - s[1], z - s[2]
    square = dx * dx + dy * dy + dz * dz
    along = 0.0
    if square > 0:
        along = min(max((px * dx + py * dy + pz * dz) / square, 0.0), 1.0)
    px -= along * dx
    py -= along * dy
    pz -= along * dz
    return math.sqrt(px * px + py * py + pz * pz)


@njit(cache=True, nogil=True, error_model="numpy")
def _to_triangle(
    x: float, y: float, z: float, a: Doubles, b: Doubles, c: Doubles
) -> float:
    """Return the distance to a triangle, by the region that the point lies in."""
    abx, aby, abz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    acx, acy, acz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    apx, apy, apz = x - a[0], y - a[1], z - a[2]
    nx, ny, nz = aby * acz - abz * acy, abz * acx - abx * acz, abx * acy - aby * acx
    n2 = nx * nx + ny * ny + nz * nz
    if n2 > 1e-18:
        # barycentric coordinates of the foot on the plane
        cx, cy, cz = apy * acz - apz * acy, apz * acx - apx * acz, apx * acy - apy * acx
        v = (cx * nx + cy * ny + cz * nz) / n2
        cx, cy, cz = aby * apz - abz * apy, abz * apx - abx * apz, abx * apy - aby * apx
        w = (cx * nx + cy * ny + cz * nz) / n2
        if v >= 0 and w >= 0 and v + w <= 1:
            foot: float = abs(apx * nx + apy * ny + apz * nz) / math.sqrt(n2)
            return foot
    ends = np.empty(6)
    ends[:3], ends[3:] = a, b
    nearest: float = _to_segment(x, y, z, ends)
    ends[:3], ends[3:] = b, c
    nearest = min(nearest, _to_segment(x, y, z, ends))
    ends[:3], ends[3:] = c, a
    return min(nearest, float(_to_segment(x, y, z, ends)))


@njit(cache=True, nogil=True, error_model="numpy")
def _smooth_distance(x: float, y: float, z: float, row: Doubles) -> float:
    """Return the signed distance to one solid without its roughness."""
    if row[0] == 0.0:
        ball: float = _to_segment(x, y, z, row[1:7]) - row[7]
        return ball
    first = _to_triangle(x, y, z, row[1:4], row[4:7], row[10:13])
    second = _to_triangle(x, y, z, row[1:4], row[10:13], row[7:10])
    sheet: float = min(first, second) - row[13]
    return sheet


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _rough_distance(
    x: float, y: float, z: float, row: Doubles, nearest: float
) -> float:
    """Return the lesser of `nearest` and the distance to one solid."""
    s = _smooth_distance(x, y, z, row)
    rough = row[14]
    # rough solids are no larger than their amplitude says
    if rough > 0.0 and abs(s) < FADE_MM and s - rough < nearest:
        seed = int(row[15])
        ragged = 0.65 * noise(x * 1.3, y * 1.3, z * 1.3, seed)
        ragged += 0.35 * noise(x * 3.1, y * 3.1, z * 3.1, seed + 7)
        s += rough * (1.0 - abs(s) / FADE_MM) * ragged
    return min(nearest, float(s))


@njit(cache=True, nogil=True, error_model="numpy")
def solids_distance(x: float, y: float, z: float, rows: Doubles) -> float:
    """Return the signed distance to a union of solids, mm, negative inside.

    Exact outside smooth solids. rows: see `surgery.solids`.
    """
    nearest = 1e30
    for n in range(rows.shape[0]):
        nearest = _rough_distance(x, y, z, rows[n], nearest)
    return nearest


@njit(cache=True, nogil=True, error_model="numpy")
def balls_around(rows: Doubles) -> Doubles:
    """Return a ball around each solid, ``(n, 4)``: its middle and its radius, mm."""
    balls = np.empty((rows.shape[0], 4))
    for n in range(rows.shape[0]):
        row = rows[n]
        count = 2 if row[0] == 0.0 else 4
        for axis in range(3):
            middle = 0.0
            for point in range(count):
                middle += row[1 + 3 * point + axis]
            balls[n, axis] = middle / count
        far = 0.0
        for point in range(count):
            square = 0.0
            for axis in range(3):
                square += (row[1 + 3 * point + axis] - balls[n, axis]) ** 2
            far = max(far, math.sqrt(square))
        far += row[7] if count == 2 else row[13]
        balls[n, 3] = far + row[14]
    return balls


@njit(cache=True, nogil=True, error_model="numpy")
def solids_distance_below(
    x: float, y: float, z: float, rows: Doubles, balls: Doubles, limit: float
) -> float:
    """Return `solids_distance` where that is below a limit, else the limit."""
    nearest = limit
    for n in range(rows.shape[0]):
        dx, dy, dz = x - balls[n, 0], y - balls[n, 1], z - balls[n, 2]
        far = nearest + balls[n, 3]
        if far > 0.0 and dx * dx + dy * dy + dz * dz < far * far:
            nearest = _rough_distance(x, y, z, rows[n], nearest)
    return nearest
