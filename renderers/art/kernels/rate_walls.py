"""Compiled: how near rays pass to walls, and how thick the wall is that they meet."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.shading.kernels.field_reads import tap

f32 = np.float32

STEPS = 16
"""Steps of a ray to the length that is resolved, where it is near a wall."""

REACH = f32(0.75)
"""How far behind a surface is looked, in resolved lengths: half of one deep is deep
enough, also at 28 degrees to the shortest way."""

LOOKS = 6
"""Places looked at on the way."""

SAFE = f32(0.9)
"""Share of the distance to the nearest wall that a ray leaps: the field is interpolated
and may promise a little more than there is."""


@njit(cache=True, nogil=True, error_model="numpy")
def rate_rows(
    distance: NDArray[np.float32], m: NDArray[np.float32], eyes: NDArray[np.float32],
    rays: NDArray[np.float32], depth: NDArray[np.float32], resolved: np.float32,
    farthest: np.float32, confidence: NDArray[np.float32], first: int, last: int,
) -> None:  # fmt: skip
    """Rate rows of pixels; see `renderers.art.wall_confidence`.

    distance: mm, negative in air. m: ``(3, 3)`` voxels per mm along world axes. eyes,
    rays: ``(h, w, 3)`` where rays begin, in voxels, and their unit directions. depth:
    ``(h, w)`` where they end, mm. resolved: mm. farthest: mm that a ray which meets
    nothing is followed.
    """
    nz, ny, nx = distance.shape
    step = resolved / f32(STEPS)
    near = f32(-0.5) * resolved - step
    for y in range(first, last):
        for x in range(depth.shape[1]):
            dx, dy, dz = rays[y, x, 0], rays[y, x, 1], rays[y, x, 2]
            if dx * dx + dy * dy + dz * dz < f32(0.5):
                continue
            ox, oy, oz = eyes[y, x, 0], eyes[y, x, 1], eyes[y, x, 2]
            vx = m[0, 0] * dx + m[0, 1] * dy + m[0, 2] * dz
            vy = m[1, 0] * dx + m[1, 1] * dy + m[1, 2] * dz
            vz = m[2, 0] * dx + m[2, 1] * dy + m[2, 2] * dz
            end = min(depth[y, x], farthest)
            t, before, rises = f32(0), f32(-np.inf), False
            closest = f32(-np.inf)
            while t < end:
                px, py, pz = ox + t * vx, oy + t * vy, oz + t * vz
                inside = (
                    f32(0) <= px <= f32(nx - 1)
                    and f32(0) <= py <= f32(ny - 1)
                    and f32(0) <= pz <= f32(nz - 1)
                )
                if not inside:
                    before, rises = f32(-np.inf), False
                    t += f32(STEPS) * step
                    continue
                d = tap(distance, px, py, pz)
                if d >= f32(0.5) * resolved:
                    # a wall that no march can miss: here, at its rim, the picture
                    # does not show what there is
                    closest = f32(-np.inf)
                    break
                if rises and d < before:
                    closest = max(closest, before)
                rises = bool(d > before)
                before = d
                t += max(-d * SAFE, step)
            rating = f32(1)
            if closest > near:
                rating = min(max(closest / near, f32(0)), f32(1))
            if depth[y, x] <= farthest:
                deep = _depth_behind(
                    distance, m, ox + end * vx, oy + end * vy, oz + end * vz, resolved
                )
                rating = min(rating, max(f32(2) * deep / resolved, f32(0)))
            confidence[y, x] = rating


@njit(cache=True, nogil=True, error_model="numpy")
def _depth_behind(
    distance: NDArray[np.float32], m: NDArray[np.float32],
    x: np.float32, y: np.float32, z: np.float32, resolved: np.float32,
) -> np.float32:  # fmt: skip
    """Give how deep it gets in a wall within `REACH` of its surface: half the wall.

    Looked for in 26 directions, of which one is within 28 degrees of any. No normal is
    asked for: a thin wall's own cannot be told from its samples.
    """
    deepest = f32(0)
    for k in range(-1, 2):
        for j in range(-1, 2):
            for i in range(-1, 2):
                length = f32(math.sqrt(f32(i * i + j * j + k * k)))
                if length == f32(0):
                    continue
                scale = REACH * resolved / (length * f32(LOOKS))
                wx, wy, wz = f32(i) * scale, f32(j) * scale, f32(k) * scale
                vx = m[0, 0] * wx + m[0, 1] * wy + m[0, 2] * wz
                vy = m[1, 0] * wx + m[1, 1] * wy + m[1, 2] * wz
                vz = m[2, 0] * wx + m[2, 1] * wy + m[2, 2] * wz
                for n in range(1, LOOKS + 1):
                    t = f32(n)
                    d = tap(distance, x + t * vx, y + t * vy, z + t * vz)
                    deepest = max(deepest, d)
    return deepest
