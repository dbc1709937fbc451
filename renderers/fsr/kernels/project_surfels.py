"""Surfels projected sixteen at a time: where a tangent disc appears, on which pixels.

Ellipses are made in float32 throughout. They bound discs with half a pixel to spare.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from renderers.fsr.kernels.array_types import F32, I32, I64, Lanes, Real
from renderers.fsr.kernels.surfel_tiles import TILE_SHIFT_X, TILE_SHIFT_Y
from renderers.fsr.kernels.view_planes import EQUIDISTANT, Lens
from renderers.simd import (
    absolute,
    bits,
    count,
    floor,
    i32,
    lanes,
    load,
    load_triples,
    maximum,
    minimum,
    put_rows4,
    rank,
    select,
    sqrt,
    store,
    store_packed,
)

NEAR_VARIANCE = np.float32(1e-6)
"""Inverse row variances below this mark a disc too near to be an ellipse: a box."""
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
_W = 16
_ZERO = np.float32(0)
_ONE = np.float32(1)
_HALF = np.float32(0.5)
# arctan(x) / x on 0..1 by powers of x^2: a minimax fit, off by 1.2e-5 at most. That is
# a hundredth of a pixel where a radian has a thousand, and ellipses have half a pixel
# to spare.
_ATAN = (
    np.float32(0.99986631), np.float32(-0.33030456), np.float32(0.18015845),
    np.float32(-0.085155207), np.float32(0.020844598),
)  # fmt: skip


class DiscLimits(NamedTuple):
    """Which discs are projected.

    nearest, farthest: their distances (mm). radius: of a disc (mm). facing: least
    cosine to the eye.
    """

    nearest: np.float32
    farthest: np.float32
    radius: np.float32
    facing: np.float32


class SurfelBuffers(NamedTuple):
    """Projected surfels.

    records: ``(n + 1, RECORD)``. boxes: ``(n + 1, 4)`` first and last column and row of
    a disc's pixels. The last row of both takes what is not wanted. ranges: ``(n +
    16,)`` tiles, see `tile_range`.
    """

    records: F32
    boxes: I32
    ranges: I32


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _pixel(
    x: Real, y: Real, z: Real, projection: int, scale: Real, width: int,
    height: int,
) -> tuple[Lanes, Lanes]:  # fmt: skip
    """Project a camera-frame point; what lies behind a pinhole goes far outside."""
    rho = math.sqrt(x * x + y * y)
    if projection == EQUIDISTANT:
        r = scale * math.atan2(rho, z) / max(rho, 1e-9)
    else:
        r = scale / max(z, 1e-3 * rho + 1e-6)
    return 0.5 * width + r * x, 0.5 * height - r * y


@njit(cache=True, nogil=True, error_model="numpy")
def rim_box(
    x: Real, y: Real, z: Real, nx: Real, ny: Real, nz: Real, radius: Real,
    projection: int, scale: Real, width: int, height: int,
) -> tuple[float, float, float, float]:  # fmt: skip
    """Return centre and half sizes of the pixel box around a disc's rim."""
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
def tile_range(left: Lanes, right: Lanes, top: Lanes, bottom: Lanes) -> Lanes:
    """Pack first and last tile column and row of a disc, seven bits in a byte each.

    Those that end are counted from 127 down: a tile is met where none of its own bytes
    is less than the disc's.
    """
    return left | (127 - right) << 8 | top << 16 | (127 - bottom) << 24


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _polar_angle(rho: Lanes, z: Lanes) -> Lanes:
    """Return atan2(rho, z) in 0..pi for rho >= 0."""
    size = absolute(z)
    x = minimum(rho, size) / maximum(maximum(rho, size), np.float32(1e-30))
    s = x * x
    p = s * _ATAN[4] + _ATAN[3]
    p = p * s + _ATAN[2]
    p = p * s + _ATAN[1]
    a = (p * s + _ATAN[0]) * x
    a = select(rho > size, np.float32(0.5 * math.pi) - a, a)
    return select(z < _ZERO, np.float32(math.pi) - a, a)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _transposed(frame: F32, row: int, x: Lanes, y: Lanes, z: Lanes) -> Lanes:
    return x * frame[row, 0] + y * frame[row, 1] + z * frame[row, 2]


@njit(cache=True, nogil=True, error_model="numpy")
def _replace_near(
    near: int, centres: F32, radius: Real, projection: int, scale: Real, width: int,
    height: int, ellipses: F32,
) -> None:  # fmt: skip
    """Put boxes around the rims in the place of the lanes whose bits are set.

    centres: x, y, z and normal of the lanes. ellipses: their u, v, half width, half
    height, one over the row variance, slope and rest.
    """
    for lane in range(_W):
        if (near >> lane) & 1 == 0:
            continue
        u, v, wide, high = rim_box(
            centres[lane],
            centres[_W + lane],
            centres[2 * _W + lane],
            centres[3 * _W + lane],
            centres[4 * _W + lane],
            centres[5 * _W + lane],
            radius,
            projection,
            scale,
            width,
            height,
        )
        ellipses[lane] = u
        ellipses[_W + lane] = v
        ellipses[2 * _W + lane] = wide
        ellipses[3 * _W + lane] = high
        ellipses[4 * _W + lane] = min(1e-4 / (high * high), 0.5 * float(NEAR_VARIANCE))
        ellipses[5 * _W + lane] = 0.0
        ellipses[6 * _W + lane] = wide * wide


@njit(cache=True, nogil=True, error_model="numpy")
def list_facing(
    runs: I64, first: int, end: int, position: F32, normal: F32, frame: F32,
    projection: int, limits: DiscLimits, found: F32,
) -> int:  # fmt: skip
    """List places from the eye, and normals, of surfels facing it; return the number.

    found: ``(6, n)``, a surfel a column, with sixteen to spare.
    Runs are short and many surfels look away: what follows has no lane to spare.
    """
    nearest, farthest, _, facing = limits
    ex, ey, ez = frame[0, 0], frame[0, 1], frame[0, 2]
    size = found.shape[1]
    n = 0
    for run in range(first, end):
        for s in range(runs[run, 0], runs[run, 1], _W):
            wx, wy, wz = load_triples(position, 3 * s, _W)
            wx -= ex
            wy -= ey
            wz -= ez
            d2 = wx * wx + wy * wy + wz * wz
            ax, ay, az = load_triples(normal, 3 * s, _W)
            plane = ax * wx + ay * wy + az * wz
            distance = sqrt(d2)
            met = (d2 >= nearest * nearest) & (d2 < farthest * farthest)
            met &= lanes(_W) < np.int32(runs[run, 1] - s)
            met &= -plane > distance * facing
            if projection != EQUIDISTANT:
                z = _transposed(frame, 3, wx, wy, wz)
                met &= z >= distance * np.float32(1e-3)
            store_packed(found, n, wx, met)
            store_packed(found, size + n, wy, met)
            store_packed(found, 2 * size + n, wz, met)
            store_packed(found, 3 * size + n, ax, met)
            store_packed(found, 4 * size + n, ay, met)
            store_packed(found, 5 * size + n, az, met)
            n += count(met)
    return n


@njit(cache=True, nogil=True, error_model="numpy")
def project_surfels(
    runs: I64, first: int, end: int, position: F32, normal: F32, frame: F32, lens: Lens,
    limits: DiscLimits, buffers: SurfelBuffers, n: int,
) -> int:  # fmt: skip
    """Project runs of surfels that face the eye, and find their tiles.

    runs: the surfels ``runs[r, 0] : runs[r, 1]`` for r from first to end - 1. Positions
    and normals have sixteen rows to spare. frame: ``(4, 3)`` eye, right, up, forward.
    n: surfels in the buffers already. Returns how many may show.
    """
    records, boxes, ranges = buffers
    projection, width, height = lens.projection, lens.width, lens.height
    extent, radius = np.float32(lens.extent), limits.radius
    half = np.float32(0.5 * min(width, height))
    scale = half / (
        extent if projection == EQUIDISTANT else np.float32(math.tan(extent))
    )
    centres = np.empty(6 * _W, np.float32)
    ellipses = np.empty(7 * _W, np.float32)
    spare = np.int32(boxes.shape[0] - 1)
    begin = n
    past = n
    for run in range(first, end):
        past += runs[run, 1] - runs[run, 0]
    size = past - n + _W
    facing_eye = np.empty((6, size), np.float32)
    seen = list_facing(
        runs, first, end, position, normal, frame, projection, limits, facing_eye
    )
    inverse = _ONE / (radius * radius)
    double = np.float32(2) * inverse
    for s in range(0, seen, _W):
        wx = load(facing_eye, s, _W)
        wy = load(facing_eye, size + s, _W)
        wz = load(facing_eye, 2 * size + s, _W)
        ax = load(facing_eye, 3 * size + s, _W)
        ay = load(facing_eye, 4 * size + s, _W)
        az = load(facing_eye, 5 * size + s, _W)
        met = lanes(_W) < np.int32(seen - s)
        d2 = wx * wx + wy * wy + wz * wz
        plane = ax * wx + ay * wy + az * wz
        distance = sqrt(d2)
        z = _transposed(frame, 3, wx, wy, wz)
        x = _transposed(frame, 1, wx, wy, wz)
        y = _transposed(frame, 2, wx, wy, wz)
        nx = _transposed(frame, 1, ax, ay, az)
        ny = _transposed(frame, 2, ax, ay, az)
        nz = _transposed(frame, 3, ax, ay, az)
        rho = sqrt(x * x + y * y)
        off_axis = rho > np.float32(1e-6)
        inward = _ONE / rho
        cx = select(off_axis, x * inward, _ONE)
        cy = select(off_axis, y * inward, _ZERO)
        nearness = _ONE / distance
        angle = radius * nearness
        # radial and tangential pixels per mm at the centre
        if projection == EQUIDISTANT:
            r = _polar_angle(rho, z) * scale
            tt = scale * nearness
            rr = z * nearness * tt
            rz = -rho * nearness * tt
            tt = select(off_axis, r * inward, tt)
        else:
            ahead = _ONE / z
            rr = scale * ahead
            r = rho * rr
            rz = -r * ahead
            tt = rr
        u = r * cx + np.float32(0.5 * width)
        v = np.float32(0.5 * height) - r * cy
        # covariance of a tangent disc: R^2 (J J^T - (J n)(J n)^T)
        nr = nx * cx + ny * cy
        nt = ny * cx - nx * cy
        jr = rr * nr + rz * nz
        jt = tt * nt
        srr = rr * rr + rz * rz - jr * jr
        srt = -jr * jt
        stt = tt * tt - jt * jt
        grow = (angle * np.float32(0.8) + _ONE) * radius
        grow *= grow
        cross = cx * cy
        twice = cross * srt * np.float32(2)
        vx = grow * (cx * cx * srr - twice + cy * cy * stt) + np.float32(SOFTEN)
        vy = grow * (cy * cy * srr + twice + cx * cx * stt) + np.float32(SOFTEN)
        vxy = -grow * (cross * (srr - stt) + (cx * cx - cy * cy) * srt)
        flat = _ONE / vy
        slope = vxy * flat
        rest = maximum(vx - vxy * slope, np.float32(0.5 * SOFTEN))
        wide = sqrt(rest + slope * slope * vy)
        high = sqrt(vy)
        near = bits(met & (angle > np.float32(NEAR_ANGLE)))
        if near != 0:
            # too near to be linear
            store(centres, 0, x)
            store(centres, _W, y)
            store(centres, 2 * _W, z)
            store(centres, 3 * _W, nx)
            store(centres, 4 * _W, ny)
            store(centres, 5 * _W, nz)
            store(ellipses, 0, u)
            store(ellipses, _W, v)
            store(ellipses, 2 * _W, wide)
            store(ellipses, 3 * _W, high)
            store(ellipses, 4 * _W, flat)
            store(ellipses, 5 * _W, slope)
            store(ellipses, 6 * _W, rest)
            _replace_near(
                near, centres, radius, projection, scale, width, height, ellipses
            )
            u = load(ellipses, 0, _W)
            v = load(ellipses, _W, _W)
            wide = load(ellipses, 2 * _W, _W)
            high = load(ellipses, 3 * _W, _W)
            flat = load(ellipses, 4 * _W, _W)
            slope = load(ellipses, 5 * _W, _W)
            rest = load(ellipses, 6 * _W, _W)
        # bounded before they become integers; ceil(a) is -floor(-a)
        right = np.float32(width)
        low = np.float32(height)
        x0 = minimum(maximum(-floor(wide - u + _HALF), _ZERO), right)
        x1 = maximum(minimum(floor(u + wide - _HALF), right - _ONE), -_ONE)
        y0 = minimum(maximum(-floor(high - v + _HALF), _ZERO), low)
        y1 = maximum(minimum(floor(v + high - _HALF), low - _ONE), -_ONE)
        met &= (x0 <= x1) & (y0 <= y1)
        side = maximum(sqrt(maximum(d2 - plane * plane, _ZERO)) - radius, _ZERO)
        least_depth = sqrt(side * side + plane * plane) * np.float32(0.999)
        row = select(met, rank(met) + np.int32(n), spare)
        at = row << 2
        steep = _ONE / plane
        put_rows4(records, at, x * double, y * double, z * double, nx * steep)
        put_rows4(records, at + 1, ny * steep, nz * steep, ax, ay)
        put_rows4(records, at + 2, az, u, v, flat)
        put_rows4(records, at + 3, slope, rest, least_depth, d2 * inverse - _ONE)
        b0, b1, b2, b3 = i32(x0), i32(x1), i32(y0), i32(y1)
        put_rows4(boxes, row, b0, b1, b2, b3)
        tiles = tile_range(
            b0 >> TILE_SHIFT_X,
            b1 >> TILE_SHIFT_X,
            b2 >> TILE_SHIFT_Y,
            b3 >> TILE_SHIFT_Y,
        )
        store_packed(ranges, n, tiles, met)
        n += count(met)
    ranges[n:past] = NO_TILE
    return n - begin
