"""Surfels projected sixteen at a time; the method is told in the scalar twin.

Positions and planes have the twin's bits. Ellipses are made in float32 throughout and
differ in rounding: they bound discs with half a pixel to spare and change none.
"""

import math
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.fsr.projection.kernels import (
    NEAR_ANGLE,
    NEAR_VARIANCE,
    SOFTEN,
    rim_box,
)
from renderers.simd import (
    absolute,
    any_,
    bits,
    count,
    floor,
    full,
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

Real = float | np.float32
F32 = NDArray[np.float32]
I32 = NDArray[np.int32]
I64 = NDArray[np.int64]

_W = 16
_ZERO = np.float32(0)
_ONE = np.float32(1)
_HALF = np.float32(0.5)

# Abramowitz and Stegun 4.4.49: arctan(x) / x on 0..1, error below 2e-8.
_ATAN = (
    np.float32(-0.3333314528), np.float32(0.1999355085), np.float32(-0.1420889944),
    np.float32(0.1065626393), np.float32(-0.0752896400), np.float32(0.0429096138),
    np.float32(-0.0161657367), np.float32(0.0028662257),
)  # fmt: skip


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _polar_angle(rho: Any, z: Any) -> Any:
    """Give atan2(rho, z) in 0..pi for rho >= 0."""
    size = absolute(z)
    x = minimum(rho, size) / maximum(maximum(rho, size), np.float32(1e-30))
    s = x * x
    p = s * _ATAN[7] + _ATAN[6]
    p = p * s + _ATAN[5]
    p = p * s + _ATAN[4]
    p = p * s + _ATAN[3]
    p = p * s + _ATAN[2]
    p = p * s + _ATAN[1]
    p = p * s + _ATAN[0]
    a = p * s * x + x
    a = select(rho > size, np.float32(0.5 * math.pi) - a, a)
    return select(z < _ZERO, np.float32(math.pi) - a, a)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _transposed(frame: F32, row: int, x: Any, y: Any, z: Any) -> Any:
    return x * frame[row, 0] + y * frame[row, 1] + z * frame[row, 2]


@njit(cache=True, nogil=True, error_model="numpy")
def _replace_near(
    near: int, centres: F32, radius: Real, projection: int, scale: Real, width: int,
    height: int, ellipses: F32,
) -> None:  # fmt: skip
    """Put boxes around the rims in the place of the lanes whose bits are set.

    centres: x, y, z and normal of the lanes. ellipses: their u, v, half width, half
    height, column variance, slope and rest.
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
        ellipses[4 * _W + lane] = max(1e4 * high * high, float(2.0 / NEAR_VARIANCE))
        ellipses[5 * _W + lane] = 0.0
        ellipses[6 * _W + lane] = wide * wide


@njit(cache=True, nogil=True, error_model="numpy")
def project_runs(
    runs: I64, first: int, end: int, position: F32, normal: F32, frame: F32,
    projection: int, extent: Real, width: int, height: int, nearest: Real,
    farthest: Real, radius: Real, facing: Real, shift_x: int, shift_y: int,
    records: F32, boxes: I32, ranges: I32, n: int,
) -> int:  # fmt: skip
    """Do as the scalar twin; positions and normals have sixteen rows to spare.

    The last row of records and of boxes takes what is not wanted.
    """
    half = np.float32(0.5 * min(width, height))
    scale = half / (extent if projection == 0 else np.float32(math.tan(extent)))
    centres = np.empty(6 * _W, np.float32)
    ellipses = np.empty(7 * _W, np.float32)
    ex, ey, ez = frame[0, 0], frame[0, 1], frame[0, 2]
    spare = np.int32(boxes.shape[0] - 1)
    begin = n
    room = n
    for run in range(first, end):
        room += runs[run, 1] - runs[run, 0]
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
            met &= lanes(_W) < runs[run, 1] - s
            met &= -plane > distance * facing
            z = _transposed(frame, 3, wx, wy, wz)
            if projection != 0:
                met &= z >= distance * np.float32(1e-3)
            if not any_(met):
                continue
            x = _transposed(frame, 1, wx, wy, wz)
            y = _transposed(frame, 2, wx, wy, wz)
            nx = _transposed(frame, 1, ax, ay, az)
            ny = _transposed(frame, 2, ax, ay, az)
            nz = _transposed(frame, 3, ax, ay, az)
            rho = sqrt(x * x + y * y)
            off_axis = rho > np.float32(1e-6)
            cx = select(off_axis, x / rho, _ONE)
            cy = select(off_axis, y / rho, _ZERO)
            angle = radius / distance
            # radial and tangential pixels per mm at the centre
            if projection == 0:
                r = _polar_angle(rho, z) * scale
                rr = z * scale / d2
                rz = -rho * scale / d2
                tt = select(off_axis, r / rho, scale / distance)
            else:
                r = rho * scale / z
                rr = scale / z
                rz = -rho * scale / (z * z)
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
            slope = vxy / vy
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
                store(ellipses, 4 * _W, vy)
                store(ellipses, 5 * _W, slope)
                store(ellipses, 6 * _W, rest)
                _replace_near(
                    near, centres, radius, projection, scale, width, height, ellipses
                )
                u = load(ellipses, 0, _W)
                v = load(ellipses, _W, _W)
                wide = load(ellipses, 2 * _W, _W)
                high = load(ellipses, 3 * _W, _W)
                vy = load(ellipses, 4 * _W, _W)
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
            put_rows4(records, at, x, y, z, nx / plane)
            put_rows4(records, at + 1, ny / plane, nz / plane, ax, ay)
            put_rows4(records, at + 2, az, u, v, _ONE / vy)
            squared = full(np.float32(radius * radius), _W)
            put_rows4(records, at + 3, slope, rest, least_depth, squared)
            b0, b1, b2, b3 = i32(x0), i32(x1), i32(y0), i32(y1)
            put_rows4(boxes, row, b0, b1, b2, b3)
            tiles = (b0 >> shift_x) | ((b1 >> shift_x) << 8)
            tiles |= ((b2 >> shift_y) << 16) | ((b3 >> shift_y) << 24)
            store_packed(ranges, n, tiles, met)
            n += count(met)
    ranges[n:room] = 255
    return n - begin
