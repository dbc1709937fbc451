"""Compiled: bounds of a triangle's picture under each lens."""

import math

import numpy as np
from numba import njit

from renderers.simd.arrays import Doubles

PERSPECTIVE = 1
"""The value of `Projection`."""

OUTERMOST = 2.6
"""Angle from the view axis, radians, beyond which a cap's picture is not bounded:
theta / sin(theta) is 5 there and infinite straight behind the eye."""

FLAT_TURN = 0.6
"""Angle a triangle may span, radians, to be bounded by its corners' pictures."""

BULGE = 0.2
"""The equidistant picture of a straight edge that spans the angle L is an arc. Its
curvature is (t - sin t cos t) / t**2 <= 0.64 per radian at the angle t <= pi/2 from
the axis and its length at most pi L / 2, so its height over the chord is at most
0.64 (pi L / 2)**2 / 8 = 0.2 L**2."""

UNSEEN = -1.0
BOXED = -2.0


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def bound_cap(y: float, sine: float, theta: float, slip: float) -> tuple[float, float]:
    """Bound the equidistant picture of a cap of directions, in radians.

    y, sine: the middle's height and distance from the view axis, of any length. theta:
    its angle from the axis. slip: the cap's half angle. Returns the height in the
    picture of its middle and how far from there it reaches in any direction, which
    may be infinite.
    """
    outermost = theta + slip
    if outermost >= OUTERMOST:
        return 0.0, math.inf
    k = theta / sine if sine > 0 else 0.0
    return k * y, slip * max(outermost / math.sin(outermost), 1.0)


@njit(cache=True, nogil=True, error_model="numpy")
def bound_equidistant(p: Doubles, widest: float, box: Doubles, at: Doubles) -> float:
    """Bound a triangle's picture ``box = (x0, x1, y0, y1)`` in radians.

    p: nine coordinates in the camera's frame. x runs right, y up. Returns by how much
    its sides may bulge out between its corners' pictures `at` (x, y three times);
    UNSEEN; or BOXED when only the box bounds it, which may be infinite.
    """
    unit = np.empty(9, np.float64)
    nearest = math.inf
    farthest = 0.0
    x0 = y0 = math.inf
    x1 = y1 = -math.inf
    for a in range(0, 9, 3):
        square = p[a] * p[a] + p[a + 1] * p[a + 1]
        scale = 1 / max(math.sqrt(square + p[a + 2] * p[a + 2]), 1e-30)
        unit[a], unit[a + 1], unit[a + 2] = (
            scale * p[a],
            scale * p[a + 1],
            scale * p[a + 2],
        )
        sine = math.sqrt(square)
        theta = math.atan2(sine, p[a + 2])
        nearest = min(nearest, theta)
        farthest = max(farthest, theta)
        k = theta / sine if sine > 0 else 0.0
        x, y = k * p[a], k * p[a + 1]
        at[a // 3 * 2], at[a // 3 * 2 + 1] = x, y
        x0, x1 = min(x0, x), max(x1, x)
        y0, y1 = min(y0, y), max(y1, y)
    longest = 0.0
    for a in range(0, 9, 3):
        b = (a + 3) % 9
        dx, dy, dz = (
            unit[a] - unit[b],
            unit[a + 1] - unit[b + 1],
            unit[a + 2] - unit[b + 2],
        )
        longest = max(longest, dx * dx + dy * dy + dz * dz)
    # an angle is at most 1.05 times its chord as far as it counts here
    longest = 1.05 * math.sqrt(longest)
    if longest < FLAT_TURN:
        if nearest - longest > widest:
            return UNSEEN
        if farthest < math.pi / 2:
            more = BULGE * longest * longest
            box[0], box[1], box[2], box[3] = x0 - more, x1 + more, y0 - more, y1 + more
            return more
    # a cap about the middle holds the triangle if it is less than half of all round
    mx = unit[0] + unit[3] + unit[6]
    my = unit[1] + unit[4] + unit[7]
    mz = unit[2] + unit[5] + unit[8]
    sine = math.sqrt(mx * mx + my * my)
    theta = math.atan2(sine, mz)
    length = max(math.sqrt(sine * sine + mz * mz), 1e-30)
    least = 1.0
    for a in range(0, 9, 3):
        along = unit[a] * mx + unit[a + 1] * my + unit[a + 2] * mz
        least = min(least, along / length)
    slip = math.acos(max(least, -1.0))
    bounded = slip < 0.49 * math.pi
    if bounded and theta - slip > widest:
        return UNSEEN
    y, more = bound_cap(my, sine, theta, slip)
    if bounded and more < math.inf:
        k = theta / sine if sine > 0 else 0.0
        x0, x1 = k * mx - more, k * mx + more
        y0, y1 = y - more, y + more
    else:
        x0 = y0 = -math.inf
        x1 = y1 = math.inf
    box[0], box[1], box[2], box[3] = x0, x1, y0, y1
    return BOXED


@njit(cache=True, nogil=True, error_model="numpy")
def bound_plane(p: Doubles, projection: int, box: Doubles, at: Doubles) -> float:
    """Bound as above the picture by a pinhole, in tangents, or by parallel rays, mm."""
    x0 = y0 = math.inf
    x1 = y1 = -math.inf
    behind = 0
    for i in range(3):
        x, y, z = p[3 * i], p[3 * i + 1], p[3 * i + 2]
        if projection == PERSPECTIVE:
            behind += 1 if z <= 1e-9 * (abs(x) + abs(y)) else 0
            x /= z
            y /= z
        else:
            behind += 1 if z < 0 else 0
        at[2 * i], at[2 * i + 1] = x, y
        x0, x1 = min(x0, x), max(x1, x)
        y0, y1 = min(y0, y), max(y1, y)
    if behind == 3:
        return UNSEEN
    open_ = behind > 0 and projection == PERSPECTIVE
    if open_:
        x0 = y0 = -math.inf
        x1 = y1 = math.inf
    box[0], box[1], box[2], box[3] = x0, x1, y0, y1
    return BOXED if open_ else 0.0
