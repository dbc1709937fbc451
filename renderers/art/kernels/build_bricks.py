"""Prepare a march: cells as bricks, distances over empty space."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.art.kernels.march_types import Samples
from renderers.simd.arrays import Lanes
from renderers.simd.functions import full, i32, maximum, minimum, rint
from renderers.simd.load_store import load, store

ZERO = np.float32(0)

SHORT = np.float32(32767)
"""What values and gradients in int16 are multiplied by while they are interpolated."""

ONE, TWO = np.float32(1), np.float32(2)

LANES = 8
"""Voxels whose gradients are found together; a block's rows are as much longer."""

FARTHEST = np.uint8(255)

# odd, or even where an odd number of them is added: no weight is even
FIRST_WEIGHT = np.uint64(0x9E3779B97F4A7C15)
NEXT_WEIGHT = np.uint64(0xD1B54A32D192ED02)
MIXER = np.uint64(0xBF58476D1CE4E5B9)


@njit(cache=True, nogil=True, error_model="numpy")
def _lower_by(
    row: NDArray[np.uint8], other: NDArray[np.uint8], near: NDArray[np.uint8]
) -> bool:
    """Lower a row by three neighbours each in another row, one step away.

    Returns whether that lowers anything.
    """
    n = len(row)
    near[0] = min(other[0], other[min(1, n - 1)])
    near[n - 1] = min(other[n - 1], other[max(n - 2, 0)])
    for x in range(1, n - 1):
        near[x] = min(min(other[x - 1], other[x]), other[x + 1])
    changes = np.uint8(0)
    for x in range(n):
        found = min(row[x], np.uint8(min(near[x], FARTHEST - 1) + 1))
        changes |= found ^ row[x]
        row[x] = found
    return bool(changes)


@njit(cache=True, nogil=True, error_model="numpy")
def _nearest_of(plane: NDArray[np.uint8], y: int, near: NDArray[np.uint8]) -> None:
    """Find the least of three rows of a plane, place by place."""
    near[:] = plane[y]
    for row in (max(y - 1, 0), min(y + 1, len(plane) - 1)):
        for x in range(len(near)):
            near[x] = min(near[x], plane[row, x])


@njit(cache=True, nogil=True, error_model="numpy")
def _lower_along(row: NDArray[np.uint8], near: NDArray[np.uint8], toward: int) -> None:
    """Lower a row by all that lies before each place, or behind it where toward is -1.

    By one step, by two, by four and on: each is a minimum of two rows, and where one
    lowers nothing none after it does.
    """
    n = len(row)
    step = 1
    while step < min(n, 256):
        lower = np.uint8(FARTHEST - step)
        changes = np.uint8(0)
        if toward > 0:
            for x in range(step, n):
                found = min(row[x], np.uint8(min(row[x - step], lower) + step))
                near[x] = found
                changes |= found ^ row[x]
            for x in range(step, n):
                row[x] = near[x]
        else:
            for x in range(n - step):
                found = min(row[x], np.uint8(min(row[x + step], lower) + step))
                near[x] = found
                changes |= found ^ row[x]
            for x in range(n - step):
                row[x] = near[x]
        if changes == 0:
            return
        step *= 2


@njit(cache=True, nogil=True, error_model="numpy")
def chebyshev(distance: NDArray[np.uint8]) -> None:
    """Turn a grid of 0 (occupied) and 255 (empty) into Chebyshev distances, in place.

    Two sweeps over half the neighbours each, row by row; what lies outside the grid
    is empty.
    """
    nz, ny, nx = distance.shape
    near, others = np.empty(nx, np.uint8), np.empty(nx, np.uint8)
    for sweep in range(2):
        toward = 1 - 2 * sweep
        for at in range(nz * ny):
            z, y = divmod(at if sweep == 0 else nz * ny - 1 - at, ny)
            row = distance[z, y]
            if 0 <= z - toward < nz:
                _nearest_of(distance[z - toward], y, others)
                _lower_by(row, others, near)
            if 0 <= y - toward < ny:
                _lower_by(row, distance[z, y - toward], near)
            _lower_along(row, near, toward)


@njit(cache=True, nogil=True, error_model="numpy")
def join_slabs(distance: NDArray[np.uint8], layers: int) -> None:
    """Make one grid of distances of slabs of so many layers, each by itself so far.

    What lies in another slab is as far as from the layer between, and one step more a
    layer. Where it lowers nothing in a layer it lowers nothing beyond.
    """
    nz, ny, nx = distance.shape
    near, others = np.empty(nx, np.uint8), np.empty(nx, np.uint8)
    last = (nz - 1) // layers * layers
    for toward in (1, -1):
        for edge in range(layers, last + 1, layers):
            z = edge if toward > 0 else last + layers - edge - 1
            changed = True
            while changed and 0 <= z < nz:
                changed = False
                for y in range(ny):
                    _nearest_of(distance[z - toward], y, others)
                    changed |= _lower_by(distance[z, y], others, near)
                z += toward


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
def _gradients(block: NDArray[np.float32], at: int) -> tuple[Lanes, Lanes, Lanes]:
    """Return Sobel's differences along x, y and z of `LANES` voxels.

    at: place in the block of the first one's corner neighbour.
    """
    wide = block.shape[2]
    plane = block.shape[1] * wide
    gx = gy = gz = full(ZERO, LANES)
    for a in range(3):
        for b in range(3):
            w = np.float32((2 - abs(a - 1)) * (2 - abs(b - 1)))
            x = at + a * plane + b * wide
            y = at + a * plane + b
            z = at + a * wide + b
            gx += w * (load(block, x + 2, LANES) - load(block, x, LANES))
            gy += w * (load(block, y + 2 * wide, LANES) - load(block, y, LANES))
            gz += w * (load(block, z + 2 * plane, LANES) - load(block, z, LANES))
    return gx, gy, gz


@njit(cache=True, nogil=True, error_model="numpy")
def _whole(x: Lanes) -> Lanes:
    """Round to whole numbers that int16 holds."""
    return i32(rint(minimum(maximum(x, -SHORT), SHORT)))


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
    volume's size, x y z. block: its rows are `LANES` longer, whatever is there.
    samples: flat, float32 or int16, to which all is rounded.
    """
    n = block.shape[0] - 2
    # 16 is the sum of the weights, 2 the width of a central difference.
    k = np.float32(1 / 32) * inverse_spacing
    kx = np.empty(n + LANES, np.float32)
    for x in range(n + LANES):
        kx[x] = k[0] * (TWO if start[0] + x in (0, size[0] - 1) else ONE)
    rows = np.empty(4 * LANES, np.float32)
    pairs, pair_rows = samples.view(np.int32), rows.view(np.int32)
    for z in range(n):
        kz = k[2] * (TWO if start[2] + z in (0, size[2] - 1) else ONE)
        for y in range(n):
            ky = k[1] * (TWO if start[1] + y in (0, size[1] - 1) else ONE)
            for first in range(0, n, LANES):
                corner = (z * block.shape[1] + y) * block.shape[2] + first
                gx, gy, gz = _gradients(block, corner)
                middle = corner + (block.shape[1] + 1) * block.shape[2] + 1
                value = load(block, middle, LANES)
                gx, gy, gz = gx * load(kx, first, LANES), gy * ky, gz * kz
                at, count = (z * n + y) * n + first, min(LANES, n - first)
                if samples.itemsize == 2:
                    low, high = i32(value) & 0xFFFF, _whole(gx) << 16
                    store(pair_rows, 0, low | high)
                    store(pair_rows, LANES, _whole(gy) & 0xFFFF | _whole(gz) << 16)
                    for i in range(count):
                        pairs[2 * (at + i)] = pair_rows[i]
                        pairs[2 * (at + i) + 1] = pair_rows[LANES + i]
                else:
                    store(rows, 0, value)
                    store(rows, LANES, gx)
                    store(rows, 2 * LANES, gy)
                    store(rows, 3 * LANES, gz)
                    for i in range(count):
                        for c in range(4):
                            samples[4 * (at + i) + c] = rows[c * LANES + i]


@njit(cache=True, nogil=True, error_model="numpy")
def build_bricks(
    values: NDArray[np.generic], starts: NDArray[np.int64], slots: NDArray[np.int64],
    side: int, size: NDArray[np.int32], inverse_spacing: NDArray[np.float32],
    channels: int, samples: Samples,
) -> None:  # fmt: skip
    """Fill slots from the volume; see `build_brick`.

    starts: ``(n, 3)`` first voxels of the cells, z y x. Beyond the volume's faces the
    outermost voxel is repeated. channels: 1 for values alone.
    """
    width, n = side + 3, side + 1
    block = np.zeros((width, width, width + LANES), np.float32)
    start = np.empty(3, np.int32)
    for c in range(len(slots)):
        z0, y0, x0 = starts[c, 0] - 1, starts[c, 1] - 1, starts[c, 2] - 1
        is_inner = x0 >= 0 and x0 + width <= size[0]
        for k in range(width):
            z = min(max(z0 + k, 0), size[2] - 1)
            for j in range(width):
                line = values[z, min(max(y0 + j, 0), size[1] - 1)]
                if is_inner:
                    for i in range(width):
                        block[k, j, i] = line[x0 + i]
                else:
                    for i in range(width):
                        block[k, j, i] = line[min(max(x0 + i, 0), size[0] - 1)]
        brick = samples[slots[c] * n**3 * channels : (slots[c] + 1) * n**3 * channels]
        if channels == 1:
            at = 0
            for k in range(1, n + 1):
                for j in range(1, n + 1):
                    for i in range(1, n + 1):
                        brick[at] = block[k, j, i]
                        at += 1
        else:
            start[0], start[1], start[2] = x0 + 1, y0 + 1, z0 + 1
            build_brick(block, start, size, inverse_spacing, brick)


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
