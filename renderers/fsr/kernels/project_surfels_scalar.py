"""Surfels projected: where a tangent disc appears and which pixels it may touch."""

import math
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

Real = float | np.float32
F32 = NDArray[np.float32]
I32 = NDArray[np.int32]
I64 = NDArray[np.int64]

NEAR_VARIANCE = np.float32(1e-6)
"""Inverse row variances below this mark a disc too near to be an ellipse: a box."""

NOWHERE = 1 << 24

RECORD = 16
"""Floats of a projected surfel: centre c 0-2 as ``2 c / r^2`` and plane 3-5 (camera
frame), normal 6-8 (world), pixel centre 9-10, ellipse 11-13 (inverse row variance,
slope, rest of the column variance), nearest depth 14, ``c^2 / r^2 - 1`` 15. r: the
radius."""

NO_TILE = 0x7F7F7F7F
"""The range of what is in no tile."""

SOFTEN = 0.5
"""Squared pixels added to an ellipse, which bounds a disc to first order."""

NEAR_ANGLE = 0.35
"""Angular radius (rad) from which a disc is bounded by a box instead of an ellipse."""


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _pixel(
    x: Real, y: Real, z: Real, projection: int, scale: Real, width: int,
    height: int,
) -> tuple[Any, Any]:  # fmt: skip
    """Project a camera-frame point; what lies behind a pinhole goes far outside."""
    rho = math.sqrt(x * x + y * y)
    if projection == 0:
        r = scale * math.atan2(rho, z) / max(rho, 1e-9)
    else:
        r = scale / max(z, 1e-3 * rho + 1e-6)
    return 0.5 * width + r * x, 0.5 * height - r * y


@njit(cache=True, nogil=True, error_model="numpy")
def rim_box(
    x: Real, y: Real, z: Real, nx: Real, ny: Real, nz: Real, radius: Real,
    projection: int, scale: Real, width: int, height: int,
) -> tuple[float, float, float, float]:  # fmt: skip
    """Give centre and half sizes of the pixel box around a disc's rim."""
    # tangents without a case distinction at the poles (Duff et al., JCGT 2017)
    sign = 1.0 if nz >= 0 else -1.0
    a = -1.0 / (sign + nz)
    b = nx * ny * a
    ax, ay, az = 1.0 + sign * nx * nx * a, sign * b, -sign * nx
    bx, by, bz = b, sign + ny * ny * a, -ny
    reach = radius * 1.02  # a polygon of sixteen around the circle
    left, right, top, bottom = 1e9, -1e9, 1e9, -1e9
    for corner in range(16):
        turn = corner * (math.pi / 8)
        c = reach * math.cos(turn)
        s = reach * math.sin(turn)
        u, v = _pixel(
            x + c * ax + s * bx,
            y + c * ay + s * by,
            z + c * az + s * bz,
            projection,
            scale,
            width,
            height,
        )
        left, right = min(left, u), max(right, u)
        top, bottom = min(top, v), max(bottom, v)
    return (
        0.5 * (left + right),
        0.5 * (top + bottom),
        0.5 * (right - left) + 1.0,
        0.5 * (bottom - top) + 1.0,
    )


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _scale(projection: int, extent: Real, width: int, height: int) -> Any:
    """Give pixels per radian, or per tangent, at the picture's middle."""
    half = 0.5 * min(width, height)
    return half / extent if projection == 0 else half / math.tan(extent)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _project(
    e: int, position: F32, normal: F32, frame: F32, projection: int, scale: Real,
    width: int, height: int, nearest: Real, farthest: Real, radius: Real,
    facing: Real, records: F32, boxes: I32, n: int,
) -> int:  # fmt: skip
    """Write surfel e as the n-th if it may show; give 1 if so, else 0."""
    ex, ey, ez = frame[0, 0], frame[0, 1], frame[0, 2]
    wx = position[e, 0] - ex
    wy = position[e, 1] - ey
    wz = position[e, 2] - ez
    d2 = wx * wx + wy * wy + wz * wz
    if not (d2 >= nearest * nearest and d2 < farthest * farthest):
        return 0
    ax, ay, az = normal[e, 0], normal[e, 1], normal[e, 2]
    plane = ax * wx + ay * wy + az * wz
    distance = math.sqrt(d2)
    if not -plane > facing * distance:
        return 0
    x = wx * frame[1, 0] + wy * frame[1, 1] + wz * frame[1, 2]
    y = wx * frame[2, 0] + wy * frame[2, 1] + wz * frame[2, 2]
    z = wx * frame[3, 0] + wy * frame[3, 1] + wz * frame[3, 2]
    nx = ax * frame[1, 0] + ay * frame[1, 1] + az * frame[1, 2]
    ny = ax * frame[2, 0] + ay * frame[2, 1] + az * frame[2, 2]
    nz = ax * frame[3, 0] + ay * frame[3, 1] + az * frame[3, 2]
    rho = math.sqrt(x * x + y * y)
    if rho > 1e-9:
        cx, cy = x / rho, y / rho
    else:
        cx, cy = 1.0, 0.0
    angle = radius / distance
    theta = math.atan2(rho, z)
    if projection == 0:
        r = scale * theta
        # radial and tangential pixels per mm at the centre
        rr, rz = scale * z / d2, -scale * rho / d2
        tt = r / rho if rho > 1e-6 else scale / distance
    else:
        if z < 1e-3 * distance:
            return 0
        r = scale * rho / z
        rr, rz, tt = scale / z, -scale * rho / (z * z), scale / z
    u = 0.5 * width + r * cx
    v = 0.5 * height - r * cy
    if angle > NEAR_ANGLE:
        # too near to be linear: the box around the projected rim
        u, v, wide, high = rim_box(
            x, y, z, nx, ny, nz, radius, projection, scale, width, height
        )
        # an ellipse so tall that its rows are all equally wide
        vy: Any = max(1e4 * high * high, 2.0 / NEAR_VARIANCE)
        slope, rest = 0.0, wide * wide
    else:
        # covariance of a tangent disc: R^2 (J J^T - (J n)(J n)^T)
        nr = nx * cx + ny * cy
        nt = ny * cx - nx * cy
        jr = rr * nr + rz * nz
        jt = tt * nt
        srr = rr * rr + rz * rz - jr * jr
        srt = -jr * jt
        stt = tt * tt - jt * jt
        grow = radius * (1.0 + 0.8 * angle)
        grow *= grow
        vx = grow * (cx * cx * srr - 2 * cx * cy * srt + cy * cy * stt) + SOFTEN
        vy = grow * (cy * cy * srr + 2 * cx * cy * srt + cx * cx * stt) + SOFTEN
        vxy = -grow * (cx * cy * (srr - stt) + (cx * cx - cy * cy) * srt)
        slope = vxy / vy
        rest = max(vx - vxy * slope, 0.5 * SOFTEN)
        wide = math.sqrt(rest + slope * slope * vy)
        high = math.sqrt(vy)
    x0 = max(math.ceil(u - wide - 0.5), 0.0)
    x1 = min(math.floor(u + wide - 0.5), width - 1.0)
    y0 = max(math.ceil(v - high - 0.5), 0.0)
    y1 = min(math.floor(v + high - 0.5), height - 1.0)
    if not (x0 <= x1 and y0 <= y1):
        return 0
    boxes[n, 0] = int(x0)
    boxes[n, 1] = int(x1)
    boxes[n, 2] = int(y0)
    boxes[n, 3] = int(y1)
    tangent = math.sqrt(max(d2 - plane * plane, 0.0))
    # along rays to the disc: nearest in the plane below the eye, if that is in it
    side = max(tangent - radius, 0.0)
    near = math.sqrt(side * side + plane * plane)
    record = records[n]
    inverse = np.float32(1) / (radius * radius)
    double = np.float32(2) * inverse
    record[0] = x * double
    record[1] = y * double
    record[2] = z * double
    steep = np.float32(1) / plane
    record[3] = nx * steep
    record[4] = ny * steep
    record[5] = nz * steep
    record[6] = ax
    record[7] = ay
    record[8] = az
    record[9] = u
    record[10] = v
    record[11] = 1.0 / vy
    record[12] = slope
    record[13] = rest
    record[14] = near * 0.999
    record[15] = d2 * inverse - np.float32(1)
    return 1


@njit(cache=True, nogil=True, error_model="numpy")
def project_surfels(
    index: I32, position: F32, normal: F32, frame: F32, projection: int, extent: Real,
    width: int, height: int, nearest: Real, farthest: Real, radius: Real,
    facing: Real, records: F32, boxes: I32, n: int,
) -> int:  # fmt: skip
    """Write records and pixel boxes (x0, x1, y0, y1) of the surfels that may show.

    nearest, farthest: only surfels at these distances from the eye (mm).
    facing: least cosine between normal and direction to the eye.
    n: first record to write; boxes that are not needed of the ``len(index)`` from
        there on are made empty. Returns the number of surfels that may show.
    """
    begin = n
    scale = _scale(projection, extent, width, height)
    for s in range(index.shape[0]):
        n += _project(
            index[s], position, normal, frame, projection, scale, width, height,
            nearest, farthest, radius, facing, records, boxes, n,
        )  # fmt: skip
    for s in range(n, begin + index.shape[0]):
        boxes[s, 2] = NOWHERE
        boxes[s, 3] = -NOWHERE
    return n - begin


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def tile_range(left: Any, right: Any, top: Any, bottom: Any) -> Any:
    """Pack first and last tile column and row of a disc, seven bits in a byte each.

    Those that end are counted from 127 down: a tile is met where none of its own bytes
    is less than the disc's.
    """
    return left | (127 - right) << 8 | top << 16 | (127 - bottom) << 24


@njit(cache=True, nogil=True, error_model="numpy")
def project_runs(
    runs: I64, first: int, end: int, position: F32, normal: F32, frame: F32,
    projection: int, extent: Real, width: int, height: int, nearest: Real,
    farthest: Real, radius: Real, facing: Real, shift_x: int, shift_y: int,
    records: F32, boxes: I32, ranges: I32, n: int,
) -> int:  # fmt: skip
    """Do as `project_surfels` with runs of surfels, and find their tiles.

    runs: the surfels ``runs[r, 0] : runs[r, 1]`` for r from first to end - 1.
    shift_x, shift_y: a tile has ``2**shift_x`` x ``2**shift_y`` pixels. ranges: first
    and last tile column and row of every surfel, a byte each from the lowest; of those
    that do not show, columns that end before they begin.
    """
    begin = n
    scale = _scale(projection, extent, width, height)
    room = n
    for r in range(first, end):
        room += runs[r, 1] - runs[r, 0]
        for e in range(runs[r, 0], runs[r, 1]):
            n += _project(
                e, position, normal, frame, projection, scale, width, height, nearest,
                farthest, radius, facing, records, boxes, n,
            )  # fmt: skip
    for s in range(begin, n):
        ranges[s] = tile_range(
            boxes[s, 0] >> shift_x,
            boxes[s, 1] >> shift_x,
            boxes[s, 2] >> shift_y,
            boxes[s, 3] >> shift_y,
        )
    ranges[n:room] = NO_TILE
    return n - begin
