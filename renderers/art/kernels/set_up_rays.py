"""Cut rays' ways through the volume into equal steps, lane by lane in float64.

A way is narrowed by three slabs (Kay and Kajiya, SIGGRAPH 1986:269).
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.art.kernels.march_types import Lanes
from renderers.simd import (
    absolute,
    any_,
    f32,
    f64,
    floor,
    full,
    i32,
    lanes,
    load,
    load_triples,
    maximum,
    minimum,
    put_rows4,
    select,
    sqrt,
    store,
)

WIDTH = 32
LEAST_RATE = 1e-12
"""Voxels per mm below which a ray runs along an axis."""

ZERO, ONE, HALF = np.float64(0), np.float64(1), np.float64(0.5)
ENDLESS = np.float64(np.inf)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _narrow(
    near: Lanes, far: Lanes, start: Lanes, along: Lanes, inverse: Lanes, top: float
) -> tuple[Lanes, Lanes]:
    """Cut what lies outside a slab off an interval."""
    a = -start * inverse
    b = (top - start) * inverse
    outside = along & ((start < ZERO) | (start > top))
    near = select(along, near, maximum(near, minimum(a, b)))
    far = select(along, far, minimum(far, maximum(a, b)))
    return near, select(outside, -ONE, far)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _combine(x: Lanes, y: Lanes, z: Lanes, a: float, b: float, c: float) -> Lanes:
    return a * x + b * y + c * z


@njit(cache=True, nogil=True, error_model="numpy")
def _set_up_packets(
    table: NDArray[np.float32],
    limit: NDArray[np.float32],
    frame: NDArray[np.float64],
    orthographic: bool,
    voxel_from_world: NDArray[np.float64],
    top: NDArray[np.float64],
    step_mm: float,
    at_ends: bool,
    geometry: NDArray[np.float32],
    count: NDArray[np.int32],
) -> None:
    """Set up whole packets of rays; what is left at the end is left alone."""
    zero = full(ZERO, WIDTH)
    f, m = frame, voxel_from_world
    per_mm = ONE / step_mm
    # all rays of a lens with an eye begin there
    ex, ey, ez = zero + f[0, 0], zero + f[0, 1], zero + f[0, 2]
    sx = _combine(ex, ey, ez, m[0, 0], m[0, 1], m[0, 2]) + m[0, 3]
    sy = _combine(ex, ey, ez, m[1, 0], m[1, 1], m[1, 2]) + m[1, 3]
    sz = _combine(ex, ey, ez, m[2, 0], m[2, 1], m[2, 2]) + m[2, 3]
    for packet in range(len(count) // WIDTH):
        ray = packet * WIDTH
        x_, y_, z_ = load_triples(table, 3 * ray, WIDTH)
        x, y, z = f64(x_), f64(y_), f64(z_)
        if orthographic:
            ex = f[0, 0] + (x * f[1, 0] + y * f[2, 0])
            ey = f[0, 1] + (x * f[1, 1] + y * f[2, 1])
            ez = f[0, 2] + (x * f[1, 2] + y * f[2, 2])
            sx = _combine(ex, ey, ez, m[0, 0], m[0, 1], m[0, 2]) + m[0, 3]
            sy = _combine(ex, ey, ez, m[1, 0], m[1, 1], m[1, 2]) + m[1, 3]
            sz = _combine(ex, ey, ez, m[2, 0], m[2, 1], m[2, 2]) + m[2, 3]
            wx, wy, wz = zero + f[3, 0], zero + f[3, 1], zero + f[3, 2]
        else:
            wx = _combine(x, y, z, f[1, 0], f[2, 0], f[3, 0])
            wy = _combine(x, y, z, f[1, 1], f[2, 1], f[3, 1])
            wz = _combine(x, y, z, f[1, 2], f[2, 2], f[3, 2])
        length = sqrt(wx * wx + wy * wy + wz * wz)
        rx = _combine(wx, wy, wz, m[0, 0], m[0, 1], m[0, 2])
        ry = _combine(wx, wy, wz, m[1, 0], m[1, 1], m[1, 2])
        rz = _combine(wx, wy, wz, m[2, 0], m[2, 1], m[2, 2])
        # one division in place of four: each inverse is the others times that of all
        least = LEAST_RATE * length
        x_along, y_along = absolute(rx) <= least, absolute(ry) <= least
        z_along = absolute(rz) <= least
        u, v = select(x_along, ONE, rx), select(y_along, ONE, ry)
        w, long = select(z_along, ONE, rz), select(length > ZERO, length, ONE)
        of_two, of_others = u * v, w * long
        of_all = ONE / (of_two * of_others)
        scale = select(length > ZERO, of_two * w * of_all, ZERO)
        of_all *= long
        near, far = zero, f64(load(limit, ray, WIDTH))
        near, far = _narrow(near, far, sx, x_along, v * of_others * of_all, top[0])
        near, far = _narrow(near, far, sy, y_along, u * of_others * of_all, top[1])
        near, far = _narrow(near, far, sz, z_along, of_two * long * of_all, top[2])
        rx, ry, rz = rx * scale, ry * scale, rz * scale
        hit = (near < far) & (far < ENDLESS)
        at = (lanes(WIDTH) + np.int32(ray)) * 2
        if not any_(hit):
            none = f32(zero)
            store(count, ray, i32(zero))
            put_rows4(geometry, at, none, none, none, none)
            put_rows4(geometry, at + 1, none, none, none, none)
            continue
        near, far = select(hit, near, ZERO), select(hit, far, ONE)
        steps = maximum(-floor((near - far) * per_mm), ONE)
        h = (far - near) / steps
        begin = near
        if at_ends:
            steps += ONE
        else:
            begin = near + HALF * h
        store(count, ray, select(hit, i32(steps), 0))
        put_rows4(
            geometry,
            at,
            f32(select(hit, sx + begin * rx, ZERO)),
            f32(select(hit, sy + begin * ry, ZERO)),
            f32(select(hit, sz + begin * rz, ZERO)),
            f32(select(hit, rx * h, ZERO)),
        )
        put_rows4(
            geometry,
            at + 1,
            f32(select(hit, ry * h, ZERO)),
            f32(select(hit, rz * h, ZERO)),
            f32(select(hit, h, ZERO)),
            f32(select(hit, begin, ZERO)),
        )


@njit(cache=True, nogil=True, error_model="numpy")
def set_up_rays(
    table: NDArray[np.float32],
    limit: NDArray[np.float32],
    frame: NDArray[np.float64],
    orthographic: bool,
    voxel_from_world: NDArray[np.float64],
    top: NDArray[np.float64],
    step_mm: float,
    at_ends: bool,
    geometry: NDArray[np.float32],
    count: NDArray[np.int32],
) -> None:
    """Cut each ray's way through the volume into equal steps.

    table: float32 (n, 3), rays as `Camera.lens_table` has them; zero directions give
    empty rays. limit: float32 (n,) mm, where rays end; +inf for those that leave the
    volume. frame: as `Camera.frame`. at_ends: samples at the ends of steps (one more
    than steps), else at the middles. Rays that miss get a geometry of zeros.
    """
    _set_up_packets(
        table, limit, frame, orthographic, voxel_from_world, top, step_mm, at_ends,
        geometry, count,
    )  # fmt: skip
    rest = len(count) % WIDTH
    if rest == 0:
        return
    # the last rays are filled up to a packet by some that end where they begin
    first = len(count) - rest
    rays, ends = np.zeros((WIDTH, 3), np.float32), np.zeros(WIDTH, np.float32)
    rays[:rest], ends[:rest] = table[first:], limit[first:]
    found, steps = np.empty((WIDTH, 8), np.float32), np.empty(WIDTH, np.int32)
    _set_up_packets(
        rays, ends, frame, orthographic, voxel_from_world, top, step_mm, at_ends,
        found, steps,
    )  # fmt: skip
    geometry[first : len(count)], count[first:] = found[:rest], steps[:rest]
