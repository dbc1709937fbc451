"""Prepare a march: cells as bricks, distances over empty space."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.art.kernels.march_types import Samples

ZERO = np.float32(0)

SHORT = np.float32(32767)
"""What values and gradients in int16 are multiplied by while they are interpolated."""

FARTHEST = np.uint8(255)

# odd, or even where an odd number of them is added: no weight is even
FIRST_WEIGHT = np.uint64(0x9E3779B97F4A7C15)
NEXT_WEIGHT = np.uint64(0xD1B54A32D192ED02)
MIXER = np.uint64(0xBF58476D1CE4E5B9)


@njit(cache=True, nogil=True, error_model="numpy")
def _nearer_row(
    row: NDArray[np.uint8], others: NDArray[np.uint8], y: int, near: NDArray[np.uint8]
) -> None:
    """Lower a row by the rows around it in a plane, one step further away."""
    for x in range(len(row)):
        near[x] = others[y, x]
    if y > 0:
        for x in range(len(row)):
            near[x] = min(near[x], others[y - 1, x])
    if y < len(others) - 1:
        for x in range(len(row)):
            near[x] = min(near[x], others[y + 1, x])
    _lower(row, near)


@njit(cache=True, nogil=True, error_model="numpy")
def _lower(row: NDArray[np.uint8], near: NDArray[np.uint8]) -> None:
    """Lower a row by three neighbours each in another row."""
    n = len(row)
    for x in range(n):
        low = min(near[x], near[max(x - 1, 0)], near[min(x + 1, n - 1)])
        row[x] = min(row[x], np.uint8(min(low, FARTHEST - 1) + 1))


@njit(cache=True, nogil=True, error_model="numpy")
def chebyshev(distance: NDArray[np.uint8]) -> None:
    """Turn a grid of 0 (occupied) and 255 (empty) into Chebyshev distances, in place.

    Two sweeps over half the neighbours each, row by row; what lies outside the grid
    is empty.
    """
    nz, ny, nx = distance.shape
    near = np.empty(nx, np.uint8)
    for z in range(nz):
        for y in range(ny):
            row = distance[z, y]
            if z > 0:
                _nearer_row(row, distance[z - 1], y, near)
            if y > 0:
                _lower(row, distance[z, y - 1])
            for x in range(1, nx):
                row[x] = min(row[x], np.uint8(min(row[x - 1], FARTHEST - 1) + 1))
    for z in range(nz - 1, -1, -1):
        for y in range(ny - 1, -1, -1):
            row = distance[z, y]
            if z < nz - 1:
                _nearer_row(row, distance[z + 1], y, near)
            if y < ny - 1:
                _lower(row, distance[z, y + 1])
            for x in range(nx - 2, -1, -1):
                row[x] = min(row[x], np.uint8(min(row[x + 1], FARTHEST - 1) + 1))


@njit(cache=True, nogil=True, error_model="numpy")
def find_clear_cubes(
    values: NDArray[np.float32], clear: NDArray[np.float32], distance: NDArray[np.uint8]
) -> None:
    """Write 255 into distance (nz-1, ny-1, nx-1) where eight voxels are clear, else 0.

    clear: intervals as `is_clear` takes them.
    """
    nz, ny, nx = distance.shape
    low, high = np.empty(nx + 1, np.float32), np.empty(nx + 1, np.float32)
    for z in range(nz):
        for y in range(ny):
            a, b = values[z, y], values[z, y + 1]
            c, d = values[z + 1, y], values[z + 1, y + 1]
            for x in range(nx + 1):
                low[x] = min(min(a[x], b[x]), min(c[x], d[x]))
                high[x] = max(max(a[x], b[x]), max(c[x], d[x]))
            for x in range(nx):
                empty = is_clear(
                    min(low[x], low[x + 1]), max(high[x], high[x + 1]), clear
                )
                distance[z, y, x] = 255 if empty else 0


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
def _rounded(x: np.float32) -> np.float32:
    return np.float32(np.rint(min(max(x, np.float32(-32767)), np.float32(32767))))


@njit(cache=True, nogil=True, error_model="numpy")
def build_brick(
    block: NDArray[np.float32],
    start: NDArray[np.int32],
    size: NDArray[np.int32],
    inverse_spacing: NDArray[np.float32],
    samples: Samples,
) -> None:
    """Fill one slot from a block of ``(side + 3)**3`` values with their ghosts.

    Gradients are Sobel's over the 26 neighbours, per mm along the array's axes;
    one-sided on the volume's faces. start, size: the cell's first voxel and the
    volume's size, x y z. samples: flat, float32 or int16, to which all is rounded.
    """
    whole = samples.itemsize == 2
    n = block.shape[0] - 2
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
                gx, gy, gz = gx * kx, gy * ky, gz * kz
                samples[at + 1] = _rounded(gx) if whole else gx
                samples[at + 2] = _rounded(gy) if whole else gy
                samples[at + 3] = _rounded(gz) if whole else gz


@njit(cache=True, nogil=True, error_model="numpy")
def find_clear(
    ranges: NDArray[np.float32], clear: NDArray[np.float32], distance: NDArray[np.uint8]
) -> None:
    """Write 255 into distance (cells,) where ranges (cells, 2) are clear, else 0."""
    for cell in range(len(ranges)):
        empty = is_clear(ranges[cell, 0], ranges[cell, 1], clear)
        distance[cell] = 255 if empty else 0


@njit(cache=True, nogil=True, error_model="numpy")
def sum_blocks(
    bits: NDArray[np.generic],
    starts: NDArray[np.int64],
    width: int,
    sums: NDArray[np.uint64],
) -> None:
    """Sum the bits of blocks, each voxel weighed by its place.

    bits: unsigned, ``(nz, ny, nx)``. starts: (n, 3) z y x, a voxel within the blocks'
    corners. Beyond the array's faces the outermost voxel is repeated. Blocks that
    differ in one voxel have different sums, others all but surely.
    """
    nz, ny, nx = bits.shape
    for n in range(len(starts)):
        total = np.uint64(0)
        for k in range(width):
            z = min(max(starts[n, 0] - 1 + k, 0), nz - 1)
            for j in range(width):
                y = min(max(starts[n, 1] - 1 + j, 0), ny - 1)
                line = bits[z, y]
                part, weight = np.uint64(0), FIRST_WEIGHT
                for i in range(width):
                    x = min(max(starts[n, 2] - 1 + i, 0), nx - 1)
                    part += np.uint64(line[x]) * weight
                    weight += NEXT_WEIGHT
                total = (total ^ part) * MIXER
        sums[n] = total
