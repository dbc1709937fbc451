"""Compiled: virtual lights traced through the distance field, and their gather.

All positions are millimetres from the eye along world axes.
"""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.shading.surface.block import (
    BOUNCE,
    C_E,
    C_T,
    C_X,
    C_Y,
    C_Z,
    CELL,
    NX,
    NY,
    NZ,
    WEIGHT,
    N,
    T,
)

f32 = np.float32
i32 = np.int32

WIDTH = 16
"""Grid points gathered together; constant, so that the loop becomes vector code."""


@njit(cache=True, nogil=True, error_model="numpy")
def tap(
    values: NDArray[np.float32], x: np.float32, y: np.float32, z: np.float32
) -> np.float32:
    """Interpolate trilinearly at voxel coordinates, clamped to the grid."""
    nz, ny, nx = values.shape
    x = min(max(x, f32(0)), f32(nx) - f32(1.001))
    y = min(max(y, f32(0)), f32(ny) - f32(1.001))
    z = min(max(z, f32(0)), f32(nz) - f32(1.001))
    i = i32(x)
    j = i32(y)
    k = i32(z)
    x -= f32(i)
    y -= f32(j)
    z -= f32(k)
    a = values[k, j, i] + x * (values[k, j, i + 1] - values[k, j, i])
    b = values[k, j + 1, i] + x * (values[k, j + 1, i + 1] - values[k, j + 1, i])
    c = values[k + 1, j, i] + x * (values[k + 1, j, i + 1] - values[k + 1, j, i])
    d = values[k + 1, j + 1, i] + x * (
        values[k + 1, j + 1, i + 1] - values[k + 1, j + 1, i]
    )
    a += y * (b - a)
    c += y * (d - c)
    result: np.float32 = a + z * (c - a)
    return result


@njit(cache=True, nogil=True, error_model="numpy")
def trace_lights(
    distance: NDArray[np.float32],
    voxel_from_mm: NDArray[np.float32],
    eye_voxel: NDArray[np.float32],
    directions: NDArray[np.float32],
    flux: NDArray[np.float32],
    longest_mm: np.float32,
    step_limit: int,
    lights: NDArray[np.float32],
) -> int:
    """March every direction from the eye to the wall; return how many arrived.

    voxel_from_mm: ``(3, 3)``. directions: ``(n, 3)`` unit, world. lights: ``(8, n)``
    filled from the left with position, normal towards air, and the ray's flux.
    """
    m = voxel_from_mm
    nz, ny, nx = distance.shape
    count = 0
    for r in range(directions.shape[0]):
        dx = directions[r, 0]
        dy = directions[r, 1]
        dz = directions[r, 2]
        vx = m[0, 0] * dx + m[0, 1] * dy + m[0, 2] * dz
        vy = m[1, 0] * dx + m[1, 1] * dy + m[1, 2] * dz
        vz = m[2, 0] * dx + m[2, 1] * dy + m[2, 2] * dz
        t = f32(0)
        arrived = False
        for _ in range(step_limit):
            x = eye_voxel[0] + t * vx
            y = eye_voxel[1] + t * vy
            z = eye_voxel[2] + t * vz
            if not (
                f32(0) <= x <= f32(nx - 1)
                and f32(0) <= y <= f32(ny - 1)
                and f32(0) <= z <= f32(nz - 1)
            ):
                break
            d = tap(distance, x, y, z)
            if d > f32(-0.04):
                arrived = True
                break
            # the field is interpolated: slightly less than its promise is safe
            t += max(f32(-0.95) * d, f32(0.05))
            if t >= longest_mm:
                break
        if not arrived:
            continue
        h = f32(0.6)
        gx = tap(distance, x + h, y, z) - tap(distance, x - h, y, z)
        gy = tap(distance, x, y + h, z) - tap(distance, x, y - h, z)
        gz = tap(distance, x, y, z + h) - tap(distance, x, y, z - h)
        wx = m[0, 0] * gx + m[1, 0] * gy + m[2, 0] * gz
        wy = m[0, 1] * gx + m[1, 1] * gy + m[2, 1] * gz
        wz = m[0, 2] * gx + m[1, 2] * gy + m[2, 2] * gz
        # distance grows into tissue: the normal towards air is against the gradient
        scale = f32(-1) / f32(math.sqrt(wx * wx + wy * wy + wz * wz + f32(1e-12)))
        lights[0, count] = t * dx
        lights[1, count] = t * dy
        lights[2, count] = t * dz
        lights[3, count] = wx * scale
        lights[4, count] = wy * scale
        lights[5, count] = wz * scale
        lights[6, count] = flux[r]
        count += 1
    return count


@njit(cache=True, nogil=True, error_model="numpy")
def gather_lights(
    depth: NDArray[np.float32],
    normal: NDArray[np.float32],
    coverage: NDArray[np.float32],
    lens: NDArray[np.float32],
    axes: NDArray[np.float32],
    lights: NDArray[np.float32],
    count: int,
    stride: int,
    grid: NDArray[np.float32],
    first: int,
    last: int,
) -> None:
    """Sum the virtual lights at every `stride`-th pixel, grid rows ``first..last``.

    grid: ``(5, gh, gw)``: one-bounce irradiance for albedo 1, then the normal and the
    depth it was gathered at; depth 0 marks a point where nothing was seen.
    """
    height, width = depth.shape
    grid_width = grid.shape[2]
    w = np.empty(8 * WIDTH, np.float32)
    px = 0
    py = WIDTH
    pz = 2 * WIDTH
    nx = 3 * WIDTH
    ny = 4 * WIDTH
    nz = 5 * WIDTH
    total = 6 * WIDTH
    for gy in range(first, last):
        row = min(gy * stride, height - 1)
        for start in range(0, grid_width, WIDTH):
            stop = min(WIDTH, grid_width - start)
            for i in range(WIDTH):
                column = min((start + min(i, stop - 1)) * stride, width - 1)
                t = depth[row, column]
                seen = coverage[row, column] > f32(0) and t < f32(1e6)
                if not seen:
                    t = f32(0)
                a = lens[row, column, 0]
                b = lens[row, column, 1]
                c = lens[row, column, 2]
                w[px + i] = t * (a * axes[0, 0] + b * axes[1, 0] + c * axes[2, 0])
                w[py + i] = t * (a * axes[0, 1] + b * axes[1, 1] + c * axes[2, 1])
                w[pz + i] = t * (a * axes[0, 2] + b * axes[1, 2] + c * axes[2, 2])
                w[nx + i] = normal[row, column, 0]
                w[ny + i] = normal[row, column, 1]
                w[nz + i] = normal[row, column, 2]
                w[total + i] = f32(0)
                if i < stop:
                    grid[4, gy, start + i] = t
            for q in range(count):
                lx = lights[0, q]
                ly = lights[1, q]
                lz = lights[2, q]
                mx = lights[3, q]
                my = lights[4, q]
                mz = lights[5, q]
                power = lights[6, q]
                softening = lights[7, q]
                for i in range(WIDTH):
                    dx = lx - w[px + i]
                    dy = ly - w[py + i]
                    dz = lz - w[pz + i]
                    d2 = dx * dx + dy * dy + dz * dz + softening
                    receive = w[nx + i] * dx + w[ny + i] * dy + w[nz + i] * dz
                    emit = mx * dx + my * dy + mz * dz
                    share = max(receive, f32(0)) * max(-emit, f32(0))
                    w[total + i] += power * share / (d2 * d2)
            for i in range(stop):
                grid[0, gy, start + i] = w[total + i] * f32(1 / math.pi)
                grid[1, gy, start + i] = w[nx + i]
                grid[2, gy, start + i] = w[ny + i]
                grid[3, gy, start + i] = w[nz + i]


@njit(cache=True, nogil=True, error_model="numpy")
def lift(w: NDArray[np.float32], grid: NDArray[np.float32], y: int, x0: int) -> None:
    """Bring the bounce light to full size: bilinear, but not across edges.

    Each of the four corners is first spread over its cell; the arithmetic then runs
    over the whole block. A loop over one cell alone would be unrolled into scalars.
    """
    gj = y // CELL
    lower = f32(y - gj * CELL) * f32(1 / CELL)
    most = grid.shape[2] - 1
    for corner in range(4):
        cj = gj + (corner >> 1)
        for cell in range(N // CELL):
            ci = min(x0 // CELL + cell + (corner & 1), most)
            e = grid[0, cj, ci]
            nx = grid[1, cj, ci]
            ny = grid[2, cj, ci]
            nz = grid[3, cj, ci]
            t = grid[4, cj, ci]
            for i in range(cell * CELL, cell * CELL + CELL):
                w[C_E + i] = e
                w[C_X + i] = nx
                w[C_Y + i] = ny
                w[C_Z + i] = nz
                w[C_T + i] = t
        row = lower if corner >> 1 else f32(1) - lower
        slope = f32(1 / CELL) if corner & 1 else f32(-1 / CELL)
        base = f32(0) if corner & 1 else f32(1)
        for i in range(N):
            t = w[C_T + i]
            dt = (t - w[T + i]) / w[T + i]
            same = w[C_X + i] * w[NX + i] + w[C_Y + i] * w[NY + i]
            same += w[C_Z + i] * w[NZ + i]
            same = max(same, f32(0))
            same *= same
            q = row * (base + slope * f32(i32(i & 7))) * (same * same + f32(1e-3))
            q = q / (f32(1) + f32(400) * dt * dt) + f32(1e-5)
            q = q if t > f32(0) else f32(0)
            w[WEIGHT + i] += q
            w[BOUNCE + i] += q * w[C_E + i]
