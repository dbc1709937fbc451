"""Prepare a march: cells as bricks, distances over empty space, first samples."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

ZERO = np.float32(0)


@njit(cache=True, nogil=True, error_model="numpy")
def chebyshev(distance: NDArray[np.uint8]) -> None:
    """Turn a grid of 0 (occupied) and 255 (empty) into Chebyshev distances, in place.

    Two sweeps over half the neighbours each; what lies outside the grid is empty.
    """
    nz, ny, nx = distance.shape
    for z in range(nz):
        for y in range(ny):
            for x in range(nx):
                d = distance[z, y, x]
                for k in range(13):
                    a, b, c = z + k // 9 - 1, y + k // 3 % 3 - 1, x + k % 3 - 1
                    if a >= 0 and 0 <= b < ny and 0 <= c < nx:
                        d = min(d, distance[a, b, c] + 1)
                distance[z, y, x] = d
    for z in range(nz - 1, -1, -1):
        for y in range(ny - 1, -1, -1):
            for x in range(nx - 1, -1, -1):
                d = distance[z, y, x]
                for k in range(13):
                    a, b, c = z + 1 - k // 9, y + 1 - k // 3 % 3, x + 1 - k % 3
                    if a < nz and 0 <= b < ny and 0 <= c < nx:
                        d = min(d, distance[a, b, c] + 1)
                distance[z, y, x] = d


@njit(cache=True, nogil=True, error_model="numpy")
def is_clear(low: np.float32, high: np.float32, clear: NDArray[np.float32]) -> bool:
    """Tell whether all of ``[low, high]`` lies in one interval of clear (k, 2).

    The interval is widened by what float32 interpolation can overshoot.
    """
    slack = np.float32(4e-6) * max(abs(low), abs(high)) + np.float32(1e-30)
    for k in range(len(clear)):
        if low - slack >= clear[k, 0] and high + slack <= clear[k, 1]:
            return True
    return False


@njit(cache=True, nogil=True, error_model="numpy")
def build_brick(
    block: NDArray[np.float32],
    start: NDArray[np.int32],
    size: NDArray[np.int32],
    inverse_spacing: NDArray[np.float32],
    clear: NDArray[np.float32],
    samples: NDArray[np.float32],
    cube_leap: NDArray[np.uint8],
) -> None:
    """Fill one slot from a block of ``(side + 3)**3`` values with their ghosts.

    Gradients are Sobel's over the 26 neighbours, per mm along the array's axes;
    one-sided on the volume's faces. start, size: the cell's first voxel and the
    volume's size, x y z. samples: flat; cube_leap: (side + 2)**3, whose border of
    zeros says that nothing is known beyond the cell.
    """
    side = block.shape[0] - 3
    n = side + 1
    for z in range(n):
        for y in range(n):
            for x in range(n):
                gx, gy, gz = ZERO, ZERO, ZERO
                for a in range(3):
                    for b in range(3):
                        w = np.float32((2 - abs(a - 1)) * (2 - abs(b - 1)))
                        gx += w * (block[z + a, y + b, x + 2] - block[z + a, y + b, x])
                        gy += w * (block[z + a, y + 2, x + b] - block[z + a, y, x + b])
                        gz += w * (block[z + 2, y + a, x + b] - block[z, y + a, x + b])
                # 16 is the sum of the weights, 2 the width of a central difference.
                kx = np.float32(1 / 32) * inverse_spacing[0]
                ky = np.float32(1 / 32) * inverse_spacing[1]
                kz = np.float32(1 / 32) * inverse_spacing[2]
                if start[0] + x == 0 or start[0] + x == size[0] - 1:
                    kx += kx
                if start[1] + y == 0 or start[1] + y == size[1] - 1:
                    ky += ky
                if start[2] + z == 0 or start[2] + z == size[2] - 1:
                    kz += kz
                at = ((z * n + y) * n + x) * 4
                samples[at] = block[z + 1, y + 1, x + 1]
                samples[at + 1] = gx * kx
                samples[at + 2] = gy * ky
                samples[at + 3] = gz * kz
    for z in range(side):
        for y in range(side):
            for x in range(side):
                low = block[z + 1, y + 1, x + 1]
                high = low
                for k in range(1, 8):
                    v = block[z + 1 + k // 4, y + 1 + k // 2 % 2, x + 1 + k % 2]
                    low, high = min(low, v), max(high, v)
                cube_leap[z + 1, y + 1, x + 1] = (
                    255 if is_clear(low, high, clear) else 0
                )
    chebyshev(cube_leap)


@njit(cache=True, nogil=True, error_model="numpy")
def find_clear(
    ranges: NDArray[np.float32], clear: NDArray[np.float32], distance: NDArray[np.uint8]
) -> None:
    """Write 255 into distance (cells,) where ranges (cells, 2) are clear, else 0."""
    for cell in range(len(ranges)):
        empty = is_clear(ranges[cell, 0], ranges[cell, 1], clear)
        distance[cell] = 255 if empty else 0


@njit(cache=True, nogil=True, error_model="numpy")
def set_up_rays(
    origins: NDArray[np.float64],
    directions: NDArray[np.float64],
    voxel_from_world: NDArray[np.float64],
    top: NDArray[np.float64],
    step_mm: float,
    at_ends: bool,
    geometry: NDArray[np.float32],
    count: NDArray[np.int32],
) -> None:
    """Cut each ray's way through the volume into equal steps, in float64.

    origins, directions: float64 (n, 3) world; zero directions give empty rays.
    at_ends: samples at the ends of steps (one more than steps), else at the middles.
    """
    start, rate = np.empty(3), np.empty(3)
    for ray in range(len(count)):
        near, far = 0.0, np.inf
        for axis in range(3):
            start[axis] = voxel_from_world[axis, 3]
            rate[axis] = 0.0
            for k in range(3):
                start[axis] += voxel_from_world[axis, k] * origins[ray, k]
                rate[axis] += voxel_from_world[axis, k] * directions[ray, k]
            if abs(rate[axis]) < 1e-12:
                if start[axis] < 0.0 or start[axis] > top[axis]:
                    far = -1.0
                continue
            a = -start[axis] / rate[axis]
            b = (top[axis] - start[axis]) / rate[axis]
            near = max(near, min(a, b))
            far = min(far, max(a, b))
        if not (near < far < np.inf):
            count[ray] = 0
            continue
        steps = max(1, math.ceil((far - near) / step_mm))
        h = (far - near) / steps
        first = near if at_ends else near + 0.5 * h
        count[ray] = steps + 1 if at_ends else steps
        for axis in range(3):
            geometry[ray, axis] = start[axis] + first * rate[axis]
            geometry[ray, 3 + axis] = rate[axis] * h
        geometry[ray, 6] = h
        geometry[ray, 7] = first
