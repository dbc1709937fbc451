"""Occlusion culling: blocks are hidden behind where cones into the walls end."""

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from renderers.fsr.kernels.array_types import F32, F64, I64, U8
from renderers.fsr.kernels.view_planes import EQUIDISTANT, Lens


class BlockReach(NamedTuple):
    """How far blocks reach, in mm.

    radius: of the ball around a block with its elements' discs. near: fine elements are
    wanted up to this distance; far: coarse ones from this.
    """

    radius: float
    near: float
    far: float


@njit(cache=True, nogil=True, error_model="numpy")
def _look_at(
    middles: F64, first: int, m: F64, radius: float, planes: F64, place: F64,
    inside: U8,
) -> None:  # fmt: skip
    """Bring balls to the camera's frame; mark which reach inside all planes.

    Simple loops without a break, which the compiler turns into vectors.
    """
    count = inside.shape[0]
    i = middles[0, first : first + count]
    j = middles[1, first : first + count]
    k = middles[2, first : first + count]
    x, y, z = place[0], place[1], place[2]
    for axis in range(3):
        a, b, c, d = m[axis, 0], m[axis, 1], m[axis, 2], m[axis, 3]
        to = place[axis]
        for n in range(count):
            to[n] = a * i[n] + b * j[n] + c * k[n] + d
    inside[:] = 1
    for p in range(planes.shape[0]):
        a, b, c, d = planes[p, 0], planes[p, 1], planes[p, 2], planes[p, 3]
        for n in range(count):
            inside[n] &= np.uint8(not a * x[n] + b * y[n] + c * z[n] + d < -radius)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _angle(y: float, x: float) -> float:
    """Return atan2(y, x) for y >= 0 to 1e-14, without a branch.

    Brought to -tan(pi/8)..tan(pi/8); atan(r) / r there by powers of r^2, a minimax fit.
    """
    size = abs(x)
    low, high = min(y, size), max(y, size)
    is_wide = low > 0.41421356237309503 * high
    r = (low - high if is_wide else low) / (low + high if is_wide else high)
    z = r * r
    p = 0.030703502826554596 * z - 0.0587732020498169
    p = p * z + 0.07564487605624363
    p = p * z - 0.09078505861720086
    p = p * z + 0.11110394201013045
    p = p * z - 0.14285690824194258
    p = p * z + 0.1999999961349995
    p = p * z - 0.33333333330873977
    p = p * z + 0.9999999999999747
    angle = r * p + (0.25 * math.pi if is_wide else 0.0)
    angle = 0.5 * math.pi - angle if y > size else angle
    return math.pi - angle if x < 0 else angle


@njit(cache=True, nogil=True, error_model="numpy")
def _bound_balls(
    place: F64, count: int, radius: float, projection: int, scale: float, width: int,
    height: int, bounds: F64,
) -> None:  # fmt: skip
    """Find the pixels that balls reach: left, right, top and bottom, and their angle.

    place: ``(3, n)``, camera frame (mm), of which `count` are asked for. bounds: ``(5,
    n)``; the angle is that of the side that is farthest from the view axis. A loop
    without a break, as above.
    """
    for n in range(count):
        x, y, z = place[0, n], place[1, n], place[2, n]
        distance = math.sqrt(x * x + y * y + z * z)
        rho = math.sqrt(x * x + y * y)
        theta = _angle(rho, z)
        # an eye in the ball has no side to see
        sine = min(radius / distance, 1 / 1.01)
        cosine = math.sqrt(1 - sine * sine)
        reach = _angle(sine, cosine)
        # of the ball's far side, and of its near one
        sine_far = (rho * cosine + z * sine) / distance
        if projection == EQUIDISTANT:
            u = scale * theta
            # a circle of directions widens where the lens does
            spread = scale * reach * max((theta + reach) / sine_far, 1.0)
        else:
            cosine_far = (z * cosine - rho * sine) / distance
            sine_near = rho * cosine - z * sine
            cosine_near = z * cosine + rho * sine
            u = scale * (rho / z)
            spread = scale * (sine_far / cosine_far) - u
            spread = max(spread, u - scale * (sine_near / cosine_near))
        is_off = rho > 1e-9
        c = x / rho if is_off else 1.0
        s = y / rho if is_off else 0.0
        bounds[0, n] = 0.5 * width + u * c - spread
        bounds[1, n] = 0.5 * width + u * c + spread
        bounds[2, n] = 0.5 * height - u * s - spread
        bounds[3, n] = 0.5 * height - u * s + spread
        bounds[4, n] = theta + reach if distance > 1.01 * radius else 4.0


@njit(cache=True, nogil=True, error_model="numpy")
def _is_blocked(bounds: F64, n: int, side: int, ends: F32, near: float) -> bool:
    """True if all squares that a ball reaches end before it begins."""
    a0 = max(math.floor(bounds[0, n] / side), 0)
    a1 = min(math.floor(bounds[1, n] / side), ends.shape[1] - 1)
    b0 = max(math.floor(bounds[2, n] / side), 0)
    b1 = min(math.floor(bounds[3, n] / side), ends.shape[0] - 1)
    for row in range(b0, b1 + 1):
        for column in range(a0, a1 + 1):
            if ends[row, column] >= near:
                return False
    return True


@njit(cache=True, nogil=True, error_model="numpy")
def flag_blocks(
    middles: F64, first: int, end: int, camera_from_voxel: F64, planes: F64,
    reach: BlockReach, lens: Lens, side: int, ends: F32, allowed: U8, shown: U8,
    distances: F32,
) -> tuple[int, int]:  # fmt: skip
    """Mark the blocks that may show: 1 beyond `reach.far`, 2 nearer than `reach.near`.

    middles: ``(3, blocks)`` voxels, x, y and z; `first`..`end` - 1 are to be done.
    planes: camera frame ``(p, 4)``, positive inside. ends: from `trace_cones`, or
    empty. allowed: per block, 0 for those that are hidden anyway. shown, distances: per
    block, the mark, 0 where nothing shows, and the distance of its middle (mm). Returns
    (blocks in view, of them hidden).
    """
    radius, near_reach, far_from = reach
    projection, extent, width, height = lens
    half = 0.5 * min(width, height)
    scale = half / extent if projection == EQUIDISTANT else half / math.tan(extent)
    widest = 2.0 if projection == EQUIDISTANT else 1.4
    place = np.empty((3, end - first))
    inside = np.empty(end - first, np.uint8)
    _look_at(middles, first, camera_from_voxel, radius, planes, place, inside)
    number = np.empty(end - first, np.int64)
    met = kept = 0
    for n in range(end - first):
        shown[first + n] = 0
        met += inside[n]
        if inside[n] and allowed[first + n]:
            number[kept] = first + n
            for axis in range(3):
                place[axis, kept] = place[axis, n]
            kept += 1
    hidden = met - kept
    bounds = np.empty((5, kept))
    if ends.shape[0]:
        _bound_balls(place, kept, radius, projection, scale, width, height, bounds)
    for k in range(kept):
        x, y, z = place[0, k], place[1, k], place[2, k]
        distance = math.sqrt(x * x + y * y + z * z)
        near = distance - radius
        is_asked = ends.shape[0] > 0 and bounds[4, k] < widest
        if is_asked and _is_blocked(bounds, k, side, ends, near):
            hidden += 1
            continue
        n = number[k]
        distances[n] = distance
        shown[n] = (1 if distance + radius >= far_from else 0) | (
            2 if near <= near_reach else 0
        )
    return met, hidden


@njit(cache=True, nogil=True, error_model="numpy")
def list_runs(
    shown: U8, mark: int, distances: F32, step: float, begins: I64, ends: I64,
    rows: I64, part: int, heads: I64, runs: I64, cuts: I64,
) -> tuple[int, int, int]:  # fmt: skip
    """List the elements of all blocks with a mark, near blocks first.

    begins, ends: of each block's elements. step: distances (mm) that differ by less
    may keep the list's order. rows: how many each block's elements are in. heads:
    scratch, one per step.
    runs: ``(blocks, 2)`` first elements and ends. cuts: ``(parts +
    1, 2)``: the runs are cut into parts of `part` or a few more elements; each part's
    first run and the number of elements before it. Returns (runs, parts, rows).
    """
    heads[:] = 0
    last = heads.shape[0] - 2
    for n in range(shown.shape[0]):
        if shown[n] & mark and ends[n] > begins[n]:
            heads[min(int(distances[n] / step), last) + 1] += 1
    for h in range(last + 1):
        heads[h + 1] += heads[h]
    total = heads[last + 1]
    kept = 0
    for n in range(shown.shape[0]):
        if shown[n] & mark and ends[n] > begins[n]:
            h = min(int(distances[n] / step), last)
            runs[heads[h], 0] = begins[n]
            runs[heads[h], 1] = ends[n]
            heads[h] += 1
            kept += rows[n]
    parts = 0
    elements = 0
    begun = 0
    for r in range(total):
        if r == 0 or elements - begun >= part:
            cuts[parts, 0] = r
            cuts[parts, 1] = begun = elements
            parts += 1
        elements += runs[r, 1] - runs[r, 0]
    cuts[parts, 0] = total
    cuts[parts, 1] = elements
    return total, parts, kept
