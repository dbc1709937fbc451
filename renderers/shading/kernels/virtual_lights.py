"""Compiled: virtual lights traced through the distance field, and their gather.

All positions are millimetres from the eye along world axes.
"""

import math

import numpy as np
from numba import njit

import renderers.shading.kernels.pixel_block as block
from renderers.shading.kernels.elementary import Four, along_axes, load3, rotated
from renderers.shading.kernels.field_reads import (
    DistanceField,
    is_outside,
    taps,
    wall_normals,
)
from renderers.shading.kernels.pixel_block import CELL, ROWS, N, W
from renderers.simd import (
    any_,
    full,
    gather,
    lanes,
    load,
    load_where,
    maximum,
    minimum,
    rows_alike,
    select,
    store,
    store_packed,
    store_where,
)
from renderers.simd import count as count_of
from renderers.simd import f32 as to_real
from renderers.simd.arrays import Flags, Floats, Lanes, f32, i32

PLANES = 5
"""Of the grid: irradiance, normal, depth."""
WIDTH = 16
"""Rays traced, and grid points gathered, together."""


@njit(cache=True, nogil=True, error_model="numpy")
def trace_lights(
    field: DistanceField,
    directions: Floats,
    flux: Floats,
    longest_mm: np.float32,
    step_limit: int,
    lights: Floats,
) -> int:
    """March every direction from the eye to the wall; return how many arrived.

    directions: ``(3, n)`` unit, world. lights: ``(8, n)``
    filled from the left with position, normal towards air, and the ray's flux.
    """
    distance, m, eye_voxel = field
    rays = directions.shape[1]
    found = 0
    for r in range(0, rays, WIDTH):
        live = lanes(WIDTH) < i32(rays - r)
        dx = load_where(directions, r, live)
        dy = load_where(directions, rays + r, live)
        dz = load_where(directions, 2 * rays + r, live)
        vx, vy, vz = rotated(m, dx, dy, dz)
        t = full(f32(0), WIDTH)
        arrived = t < f32(0)
        for _ in range(step_limit):
            x = eye_voxel[0] + t * vx
            y = eye_voxel[1] + t * vy
            z = eye_voxel[2] + t * vz
            live &= ~is_outside(distance, x, y, z)
            d = taps(distance, x, y, z)
            arrived |= live & (d > f32(-0.04))
            live &= ~arrived
            # the field is interpolated: slightly less than its promise is safe
            t += select(live, maximum(f32(-0.95) * d, f32(0.05)), f32(0))
            live &= t < longest_mm
            if not any_(live):
                break
        if not any_(arrived):
            continue
        x = eye_voxel[0] + t * vx
        y = eye_voxel[1] + t * vy
        z = eye_voxel[2] + t * vz
        nx, ny, nz = wall_normals(distance, m, x, y, z)
        store_packed(lights, found, t * dx, arrived)
        store_packed(lights, rays + found, t * dy, arrived)
        store_packed(lights, 2 * rays + found, t * dz, arrived)
        store_packed(lights, 3 * rays + found, nx, arrived)
        store_packed(lights, 4 * rays + found, ny, arrived)
        store_packed(lights, 5 * rays + found, nz, arrived)
        own = load_where(flux, r, arrived)
        store_packed(lights, 6 * rays + found, own, arrived)
        found += count_of(arrived)
    return found


@njit(cache=True, nogil=True, error_model="numpy")
def gather_lights(
    depth: Floats,
    normal: Floats,
    coverage: Floats,
    lens: Floats,
    axes: Floats,
    lights: Floats,
    count: int,
    stride: int,
    points: Flags,
    grid: Floats,
    first: int,
    last: int,
) -> None:
    """Sum the virtual lights at every `stride`-th pixel, grid rows ``first..last``.

    points: ``(gh, gw)``, those wanted; their neighbours in a vector get something, too.
    grid: ``(5, gh, gw)``: one-bounce irradiance for albedo 1, then the normal and the
    depth it was gathered at; depth 0 marks a point where nothing was seen.
    """
    height, width = depth.shape
    grid_width = grid.shape[2]
    plane = grid.shape[1] * grid_width
    every = lanes(WIDTH) >= 0
    # places and normals of those that see anything: no vector is half empty
    room = (last - first) * grid_width + WIDTH
    place = np.empty((6, room), np.float32)
    number = np.empty(room, np.int32)
    light = np.empty(room, np.float32)
    met = 0
    for gy in range(first, last):
        row = min(gy * stride, height - 1)
        for start in range(0, grid_width, WIDTH):
            if not points[gy, start : start + WIDTH].any():
                continue
            inside = lanes(WIDTH) < np.int32(grid_width - start)
            column = minimum((lanes(WIDTH) + start) * stride, np.int32(width - 1))
            at = column + row * width
            t = gather(depth, at, every)
            seen = (gather(coverage, at, every) > f32(0)) & (t < f32(1e6))
            t = select(seen, t, f32(0))
            at *= 3
            a = gather(lens, at, every)
            b = gather(lens, at + 1, every)
            c = gather(lens, at + 2, every)
            nx = gather(normal, at, every)
            ny = gather(normal, at + 1, every)
            nz = gather(normal, at + 2, every)
            to = gy * grid_width + start
            store_where(grid, to, full(f32(0), WIDTH), inside)
            store_where(grid, to + plane, nx, inside)
            store_where(grid, to + 2 * plane, ny, inside)
            store_where(grid, to + 3 * plane, nz, inside)
            store_where(grid, to + 4 * plane, t, inside)
            seen &= inside
            rx, ry, rz = along_axes(axes, a, b, c)
            store_packed(place, met, t * rx, seen)
            store_packed(place, room + met, t * ry, seen)
            store_packed(place, 2 * room + met, t * rz, seen)
            store_packed(place, 3 * room + met, nx, seen)
            store_packed(place, 4 * room + met, ny, seen)
            store_packed(place, 5 * room + met, nz, seen)
            store_packed(number, met, lanes(WIDTH) + np.int32(to), seen)
            met += count_of(seen)
    for n in range(0, met, WIDTH):
        px = load(place, n, WIDTH)
        py = load(place, room + n, WIDTH)
        pz = load(place, 2 * room + n, WIDTH)
        nx = load(place, 3 * room + n, WIDTH)
        ny = load(place, 4 * room + n, WIDTH)
        nz = load(place, 5 * room + n, WIDTH)
        total = full(f32(0), WIDTH)
        for q in range(count):
            dx = lights[0, q] - px
            dy = lights[1, q] - py
            dz = lights[2, q] - pz
            d2 = dx * dx + dy * dy + dz * dz + lights[7, q]
            receive = maximum(nx * dx + ny * dy + nz * dz, f32(0))
            emit = lights[3, q] * dx + lights[4, q] * dy + lights[5, q] * dz
            share = receive * minimum(emit, f32(0))
            total -= lights[6, q] * share / (d2 * d2)
        store(light, n, total * f32(1 / math.pi))
    flat = grid.reshape(-1)
    for n in range(met):
        flat[number[n]] = light[n]


@njit(cache=True, nogil=True, error_model="numpy")
def spread_grid(grid: Floats, row: int, spread: Floats) -> None:
    """Repeat every point of two rows of the grid over the pixels of its cell.

    spread: ``(2, 5, n)``, n at least the picture's width and a cell more. Serves the
    `CELL` picture rows below the grid's `row`.
    """
    most = grid.shape[2] - 1
    for j in range(2):
        for plane in range(PLANES):
            for x in range(spread.shape[2]):
                spread[j, plane, x] = grid[plane, row + j, min(x // CELL, most)]


@njit(cache=True, nogil=True, error_model="numpy")
def corner(spread: Floats, at: int, nx: Lanes, ny: Lanes, nz: Lanes, k: Lanes) -> Four:
    """Return a corner's weight as a quotient, what it lights, and its depth."""
    n = spread.shape[2]
    # all rows of a block lie between the same points
    same = rows_alike(load(spread, at + n, W), ROWS) * nx
    same += rows_alike(load(spread, at + 2 * n, W), ROWS) * ny
    same += rows_alike(load(spread, at + 3 * n, W), ROWS) * nz
    same = maximum(same, f32(0))
    same *= same
    t = rows_alike(load(spread, at + 4 * n, W), ROWS)
    apart = t * k - f32(1)
    below = f32(1) + f32(400) * (apart * apart)
    lit = rows_alike(load(spread, at, W), ROWS)
    return same * same + f32(1e-3), below, lit, t


@njit(cache=True, nogil=True, error_model="numpy")
def lift(w: Floats, spread: Floats, y0: int, x0: int) -> None:
    """Bring the bounce light to full size: bilinear, but not across edges.

    spread: of the block's two grid rows, see `spread_grid`. x0 must be a multiple of
    CELL, and y0 one of ROWS.
    """
    here = lanes(N)
    right = to_real(here & (CELL - 1)) * f32(1 / CELL)
    left = f32(1) - right
    lower = to_real((here >> 4) + np.int32(y0 % CELL)) * f32(1 / CELL)
    k = f32(1) / load(w, block.T, N)
    nx, ny, nz = load3(w, block.NX)
    total = full(f32(0), N)
    weight = full(f32(1e-6), N)
    row = f32(1) - lower
    for j in range(2):
        at = j * PLANES * spread.shape[2] + x0
        a, under_a, light_a, t_a = corner(spread, at, nx, ny, nz, k)
        b, under_b, light_b, t_b = corner(spread, at + CELL, nx, ny, nz, k)
        # one division for two weights; their product stays below 1e30 at any depth
        both = row / (under_a * under_b)
        a = a * left * (under_b * both) + f32(1e-5)
        b = b * right * (under_a * both) + f32(1e-5)
        # a point where nothing is seen has no depth
        a = select(t_a > f32(0), a, f32(0))
        b = select(t_b > f32(0), b, f32(0))
        weight += a + b
        total += a * light_a + b * light_b
        row = lower
    store(w, block.BOUNCE, total / weight)
