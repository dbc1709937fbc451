"""Blocks tested against where cones into the walls end, and listed."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

F32 = NDArray[np.float32]
F64 = NDArray[np.float64]
I32 = NDArray[np.int32]
I64 = NDArray[np.int64]
U8 = NDArray[np.uint8]


@njit(cache=True, nogil=True, error_model="numpy")
def _look_at(
    middles: F64, first: int, m: F64, radius: float, planes: F64, place: F64,
    inside: U8,
) -> None:  # fmt: skip
    """Bring balls to the camera's frame; say which reach inside all planes.

    Simple loops without a way out, which the compiler turns into vectors.
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


@njit(cache=True, nogil=True, error_model="numpy")
def flag_blocks(
    middles: F64, first: int, end: int, camera_from_voxel: F64, radius: float,
    planes: F64, near_reach: float, far_from: float, projection: int, extent: float,
    width: int, height: int, side: int, ends: F32, allowed: U8, shown: U8,
    distances: F32,
) -> tuple[int, int]:  # fmt: skip
    """Mark the blocks that may show: 1 beyond `far_from`, 2 nearer than `near_reach`.

    middles: ``(3, blocks)`` voxels, x, y and z; `first`..`end` - 1 are to be done.
    radius: of the ball around a block with its elements' discs (mm). planes: camera
    frame ``(p, 4)``, positive inside. ends: from `trace_cones`, or empty. allowed: per
    block, 0 for those that are hidden anyway. shown, distances: per block, the mark, 0
    where nothing shows, and the distance of its middle (mm).
    Returns (blocks in view, of them hidden).
    """
    half = 0.5 * min(width, height)
    scale = half / extent if projection == 0 else half / math.tan(extent)
    met = 0
    hidden = 0
    place = np.empty((3, end - first))
    inside = np.empty(end - first, np.uint8)
    _look_at(middles, first, camera_from_voxel, radius, planes, place, inside)
    for n in range(first, end):
        shown[n] = 0
        if not inside[n - first]:
            continue
        met += 1
        if not allowed[n]:
            hidden += 1
            continue
        x, y, z = place[0, n - first], place[1, n - first], place[2, n - first]
        distance = math.sqrt(x * x + y * y + z * z)
        near = distance - radius
        if ends.shape[0]:
            rho = math.sqrt(x * x + y * y)
            theta = math.atan2(rho, z)
            reach = math.asin(radius / distance) if distance > 1.01 * radius else 1.6
            if theta + reach < (2.0 if projection == 0 else 1.4):
                if projection == 0:
                    u = scale * theta
                    spread = scale * reach
                    # a circle of directions widens where the lens does
                    spread *= max((theta + reach) / math.sin(theta + reach), 1.0)
                else:
                    u = scale * math.tan(theta)
                    spread = scale * math.tan(theta + reach) - u
                    spread = max(spread, u - scale * math.tan(theta - reach))
                c = x / rho if rho > 1e-9 else 1.0
                s = y / rho if rho > 1e-9 else 0.0
                px = 0.5 * width + u * c
                py = 0.5 * height - u * s
                a0 = max(math.floor((px - spread) / side), 0)
                a1 = min(math.floor((px + spread) / side), ends.shape[1] - 1)
                b0 = max(math.floor((py - spread) / side), 0)
                b1 = min(math.floor((py + spread) / side), ends.shape[0] - 1)
                blocked = True
                for row in range(b0, b1 + 1):
                    for column in range(a0, a1 + 1):
                        if ends[row, column] >= near:
                            blocked = False
                            break
                    if not blocked:
                        break
                if blocked:
                    hidden += 1
                    continue
        distances[n] = distance
        shown[n] = (1 if distance + radius >= far_from else 0) | (
            2 if near <= near_reach else 0
        )
    return met, hidden


@njit(cache=True, nogil=True, error_model="numpy")
def list_runs(
    shown: U8, mark: int, distances: F32, step: float, offsets: I64, part: int,
    rows: I64, heads: I64, runs: I64, cuts: I64,
) -> tuple[int, int, int]:  # fmt: skip
    """List the elements of all blocks with a mark, near blocks first.

    offsets: where each block's elements begin, and their end. step: distances (mm)
    that differ by less may keep the list's order. rows: how many each block's
    elements are in. heads: scratch, one per step.
    runs: room for ``(blocks, 2)`` first elements and ends. cuts: room for ``(parts +
    1, 2)``: the runs are cut into parts of `part` or a few more elements; each part's
    first run and the number of elements before it. Returns (runs, parts, rows).
    """
    heads[:] = 0
    last = heads.shape[0] - 2
    for n in range(shown.shape[0]):
        if shown[n] & mark and offsets[n + 1] > offsets[n]:
            heads[min(int(distances[n] / step), last) + 1] += 1
    for h in range(last + 1):
        heads[h + 1] += heads[h]
    total = heads[last + 1]
    kept = 0
    for n in range(shown.shape[0]):
        if shown[n] & mark and offsets[n + 1] > offsets[n]:
            h = min(int(distances[n] / step), last)
            runs[heads[h], 0] = offsets[n]
            runs[heads[h], 1] = offsets[n + 1]
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
