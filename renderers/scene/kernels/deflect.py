"""Compiled: where bent rays look, point by point, in float64.

The plain twin is `renderers.scene.deflection`. Points are mm along the array's axes,
from its first voxel. maps: float64 (n, 9), one deflector a row, in their order: kind,
centre x y z, radius, vector x y z (shift, axis or normal), amount (angle in rad, k of
``1 + k w``, or the pull of a cut in mm).
"""

import math

import numpy as np
from numba import njit

from renderers.simd.arrays import Doubles, Flags, Floats, Ints

TRANSLATION, ROTATION, SCALING, CUT = 0, 1, 2, 3

TOLD_BY_MM = 1e-4
"""Half the way over which the slope of a cut's face is measured."""

CLEAR_SHARE = 0.95
"""Of a way that is clear by the distance: between voxels it may be a little more."""


@njit(cache=True, nogil=True, error_model="numpy")
def bend(maps: Doubles, point: Doubles, trail: Doubles) -> float:
    """Move a point to the place that is seen there; give the opening of cuts.

    trail: (n, 3), becomes where the point was before each map took it. The opening is
    the distance from the nearest cut's face, negative in its gap.
    """
    opening = np.inf
    for k in range(len(maps) - 1, -1, -1):
        trail[k] = point
        x, y, z = point[0] - maps[k, 1], point[1] - maps[k, 2], point[2] - maps[k, 3]
        s2 = (x * x + y * y + z * z) / (maps[k, 4] * maps[k, 4])
        if s2 >= 1.0:
            continue
        w = (1.0 - s2) * (1.0 - s2)
        kind = int(maps[k, 0])
        vx, vy, vz, amount = maps[k, 5], maps[k, 6], maps[k, 7], maps[k, 8]
        if kind == TRANSLATION:
            point[0] -= vx * w
            point[1] -= vy * w
            point[2] -= vz * w
        elif kind == SCALING:
            point[0] += amount * w * x
            point[1] += amount * w * y
            point[2] += amount * w * z
        elif kind == ROTATION:
            ax, ay, az = turned(x, y, z, vx, vy, vz, -amount * w)
            point[0] = maps[k, 1] + ax
            point[1] = maps[k, 2] + ay
            point[2] = maps[k, 3] + az
        else:
            height = x * vx + y * vy + z * vz
            opening = min(opening, abs(height) - amount * w)
            side = amount * w if height >= 0.0 else -amount * w
            point[0] -= vx * side
            point[1] -= vy * side
            point[2] -= vz * side
    return opening


@njit(cache=True, nogil=True, error_model="numpy")
def bend_gradient(maps: Doubles, trail: Doubles, gradient: Doubles) -> None:
    """Turn a gradient at the place seen into one where it is seen: by J transposed.

    trail: as `bend` left it.
    """
    for k in range(len(maps)):
        x, y, z = (
            trail[k, 0] - maps[k, 1],
            trail[k, 1] - maps[k, 2],
            trail[k, 2] - maps[k, 3],
        )
        r2 = maps[k, 4] * maps[k, 4]
        rest = 1.0 - (x * x + y * y + z * z) / r2
        if rest <= 0.0:
            continue
        w, fall = rest * rest, -4.0 * rest / r2
        kind = int(maps[k, 0])
        vx, vy, vz, amount = maps[k, 5], maps[k, 6], maps[k, 7], maps[k, 8]
        gx, gy, gz = gradient[0], gradient[1], gradient[2]
        if kind == SCALING:
            along = amount * fall * (x * gx + y * gy + z * gz)
            gx, gy, gz = (
                gx + amount * w * gx,
                gy + amount * w * gy,
                gz + amount * w * gz,
            )
        elif kind == ROTATION:
            ax, ay, az = turned(x, y, z, vx, vy, vz, -amount * w)
            cx, cy, cz = vy * az - vz * ay, vz * ax - vx * az, vx * ay - vy * ax
            along = -amount * fall * (cx * gx + cy * gy + cz * gz)
            gx, gy, gz = turned(gx, gy, gz, vx, vy, vz, amount * w)
        else:
            pull = 1.0
            if kind == CUT:
                pull = amount if x * vx + y * vy + z * vz >= 0.0 else -amount
            along = -fall * pull * (vx * gx + vy * gy + vz * gz)
        gradient[0] = gx + along * x
        gradient[1] = gy + along * y
        gradient[2] = gz + along * z


@njit(cache=True, nogil=True, error_model="numpy")
def slope_of_opening(
    maps: Doubles,
    at: Doubles,
    beside: Doubles,
    trail: Doubles,
    slope: Doubles,
) -> None:
    """Find how the distance from the nearest cut's face grows about a place, mm a mm.

    at: (3,), kept. beside, trail: room, as for `bend`. slope: (3,), becomes the slope
    times twice `TOLD_BY_MM`; no number on a ball's rim, beyond which there is no face.
    """
    for k in range(3):
        beside[:] = at
        beside[k] += TOLD_BY_MM
        more = bend(maps, beside, trail)
        beside[:] = at
        beside[k] -= TOLD_BY_MM
        slope[k] = more - bend(maps, beside, trail)


@njit(cache=True, nogil=True, error_model="numpy")
def clear_way(inside: float, opening: float, stretch: float) -> float:
    """Return how far (mm) a ray in air may go on without missing tissue.

    inside: the distance that is seen, negative in air. stretch: mm that what is seen
    moves at most for a mm of the ray.
    In a gap that is to its face. Beside it there is tissue where the distance says so,
    on the far side of the gap as well: in the undeformed tissue the two faces are one
    plane, and what is seen runs on along it while the ray crosses the gap.
    """
    way = -opening if opening < 0.0 else -inside
    return CLEAR_SHARE * way / stretch


@njit(cache=True, nogil=True, error_model="numpy")
def turned(
    x: float, y: float, z: float, ux: float, uy: float, uz: float, angle: float
) -> tuple[float, float, float]:
    """Turn a vector about a unit axis (Rodrigues)."""
    c, s = math.cos(angle), math.sin(angle)
    along = (1.0 - c) * (ux * x + uy * y + uz * z)
    return (
        c * x + s * (uy * z - uz * y) + along * ux,
        c * y + s * (uz * x - ux * z) + along * uy,
        c * z + s * (ux * y - uy * x) + along * uz,
    )


@njit(cache=True, nogil=True, error_model="numpy")
def away(maps: Doubles, point: Doubles) -> float:
    """Return how far (mm) a point is from all balls, 0 inside any."""
    least = np.inf
    for k in range(len(maps)):
        x, y, z = point[0] - maps[k, 1], point[1] - maps[k, 2], point[2] - maps[k, 3]
        least = min(least, math.sqrt(x * x + y * y + z * z) - maps[k, 4])
    return max(least, 0.0)


@njit(cache=True, nogil=True, error_model="numpy")
def entry(maps: Doubles, eye: Doubles, way: Doubles) -> float:
    """Return how far (mm) along a ray the first ball begins, infinite for none.

    eye: (3,), where the ray begins. way: (3,) unit.
    """
    first = np.inf
    for k in range(len(maps)):
        near = away2 = 0.0
        for axis in range(3):
            to_centre = maps[k, 1 + axis] - eye[axis]
            near += to_centre * way[axis]
            away2 += to_centre * to_centre
        half2 = maps[k, 4] * maps[k, 4] - (away2 - near * near)
        if half2 > 0.0:
            half = math.sqrt(half2)
            if near + half > 0.0:
                first = min(first, max(near - half, 0.0))
    return first


@njit(cache=True, nogil=True, error_model="numpy")
def find_bent(
    maps: Doubles,
    geometry: Floats,
    count: Ints,
    spacing: Doubles,
    slack: float,
    bent: Flags,
) -> None:
    """Mark the rays that come within `slack` mm of any ball between their ends."""
    for ray in range(len(count)):
        bent[ray] = False
        n = count[ray] - 1
        if n < 0:
            continue
        for k in range(len(maps)):
            rate2 = near = gap2 = 0.0
            for axis in range(3):
                o = geometry[ray, axis] * spacing[axis] - maps[k, 1 + axis]
                d = geometry[ray, 3 + axis] * spacing[axis]
                rate2 += d * d
                near -= o * d
            at = min(max(near / rate2, 0.0), float(n))
            for axis in range(3):
                o = geometry[ray, axis] * spacing[axis] - maps[k, 1 + axis]
                o += at * geometry[ray, 3 + axis] * spacing[axis]
                gap2 += o * o
            reach = maps[k, 4] + slack
            if gap2 < reach * reach:
                bent[ray] = True
