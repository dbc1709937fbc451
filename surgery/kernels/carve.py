"""Take a tool's solids out of the tissue, and keep the books to the last count."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from surgery.kernels.solid_distance import solids_distance

FULL = 65535
"""Fill of a voxel that is all tissue. Counts of the books are shares of this."""

Bytes = NDArray[np.uint8]
Floats = NDArray[np.float32]
Doubles = NDArray[np.float64]
Longs = NDArray[np.int64]
Fill = NDArray[np.uint16]


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def filled(distance: float, per_mm: float) -> int:
    """Return the fill of a voxel at a distance below the surface."""
    share = min(max(0.5 + distance * per_mm, 0.0), 1.0)
    return math.floor(share * FULL + 0.5)


@njit(cache=True, nogil=True, error_model="numpy")
def fill_all(distance: Floats, per_mm: float, fill: Fill) -> None:
    """Find the fill of every voxel."""
    for k in range(distance.shape[0]):
        for j in range(distance.shape[1]):
            for i in range(distance.shape[2]):
                fill[k, j, i] = filled(distance[k, j, i], per_mm)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _share(low: float, high: float, upper: float) -> float:
    """Return the share of an interval of depths that lies above `upper`."""
    return min(max((upper - low) / (high - low), 0.0), 1.0)


@njit(cache=True, nogil=True, error_model="numpy")
def book(
    was: int, now: int, depth: float, half: float, mucosa: float, bone: float,
    kinds: Bytes, row: int, ground: int, by_label: Longs, by_wall: Longs,
) -> None:  # fmt: skip
    """Put the fill that a voxel lost into the books, shared out over its layers.

    What is left of each layer follows from the voxel's fill alone. So the sum over any
    steps is that of one step, and no count is lost. depth: pristine, of its middle;
    half: half its edge; mucosa, bone: thicknesses. kinds: ``(256, 2)`` labels of
    mucosa and bone by wall row.
    """
    low = max(depth - half, 0.0)
    high = max(depth + half, low + 1e-6)
    first = _share(low, high, mucosa)
    second = _share(low, high, mucosa + bone)
    a = math.floor(first * FULL + 0.5)
    b = math.floor(second * FULL + 0.5)
    flesh = was * a // FULL - now * a // FULL
    both = was * b // FULL - now * b // FULL
    by_label[kinds[row, 0]] += flesh
    by_label[kinds[row, 1]] += both - flesh
    by_label[ground] += (was - now) - both
    by_wall[row] += both - flesh


@njit(cache=True, nogil=True, error_model="numpy")
def carve(
    distance: Floats, fill: Fill, pristine: Floats, walls: tuple[Bytes, Bytes],
    tables: tuple[Floats, Floats, Bytes, Bytes], rows: Doubles, grid: Doubles,
    box: Longs, books: tuple[Longs, Longs], bounds: Longs,
) -> int:  # fmt: skip
    """Carve a box: distance becomes the lesser of itself and the tool's.

    distance, fill: mutable, pristine: not. walls: row of the wall, and ground label.
    tables: ``(256, 2)`` mucosa and bone thickness by row; ``(256,)`` depth that may be
    taken by row, +inf for all; ``(256,)`` 1 for grounds that are too hard; ``(256,
    2)`` labels by row. rows: solids. grid: ``(5, 3)`` float64: origin, columns of the
    axes times their spacing as rows, and spacing. box: i0 j0 k0 i1 j1 k1, ends
    excluded. books: counts by label and by wall. bounds: ``(6,)``, first and last
    changed voxel. Returns the number of voxels that changed.
    """
    wall, ground = walls
    layers, spared, hard, kinds = tables
    by_label, by_wall = books
    h = max(grid[4, 0], max(grid[4, 1], grid[4, 2]))
    per_mm = 1.0 / h
    bounds[:3] = 1 << 30
    bounds[3:] = -1
    count = 0
    for k in range(box[2], box[5]):
        for j in range(box[1], box[4]):
            for i in range(box[0], box[3]):
                x = grid[0, 0] + i * grid[1, 0] + j * grid[2, 0] + k * grid[3, 0]
                y = grid[0, 1] + i * grid[1, 1] + j * grid[2, 1] + k * grid[3, 1]
                z = grid[0, 2] + i * grid[1, 2] + j * grid[2, 2] + k * grid[3, 2]
                s = solids_distance(x, y, z, rows)
                old = distance[k, j, i]
                if not s < old:
                    continue
                row, below = wall[k, j, i], ground[k, j, i]
                depth = pristine[k, j, i]
                mucosa, bone = layers[row, 0], layers[row, 1]
                least = spared[row]
                if hard[below]:
                    least = min(least, mucosa + bone)
                if least < 1e6:
                    s = max(s, float(depth) - least)
                new = np.float32(s)
                if not new < old:
                    continue
                distance[k, j, i] = new
                count += 1
                bounds[0], bounds[3] = min(bounds[0], i), max(bounds[3], i)
                bounds[1], bounds[4] = min(bounds[1], j), max(bounds[4], j)
                bounds[2], bounds[5] = min(bounds[2], k), max(bounds[5], k)
                was, now = int(fill[k, j, i]), filled(float(new), per_mm)
                if now < was:
                    fill[k, j, i] = now
                    book(
                        was, now, depth, 0.5 * h, mucosa, bone, kinds, row, below,
                        by_label, by_wall,
                    )  # fmt: skip
    return count


@njit(cache=True, nogil=True, error_model="numpy")
def clear_pieces(
    distance: Floats, fill: Fill, pristine: Floats, walls: tuple[Bytes, Bytes],
    tables: tuple[Floats, Floats, Bytes, Bytes], loose: Bytes, box: Longs, h: float,
    books: tuple[Longs, Longs],
) -> int:  # fmt: skip
    """Make air of the voxels that are marked as loose pieces; returns their number.

    loose: over the box. Other arrays as in `carve`.
    """
    wall, ground = walls
    layers, _, _, kinds = tables
    by_label, by_wall = books
    air = np.float32(-0.5 * h)
    count = 0
    for k in range(box[2], box[5]):
        for j in range(box[1], box[4]):
            for i in range(box[0], box[3]):
                if not loose[k - box[2], j - box[1], i - box[0]]:
                    continue
                if not distance[k, j, i] > air:
                    continue
                distance[k, j, i] = air
                count += 1
                was = int(fill[k, j, i])
                if was == 0:
                    continue
                fill[k, j, i] = 0
                row = wall[k, j, i]
                book(
                    was, 0, pristine[k, j, i], 0.5 * h, layers[row, 0], layers[row, 1],
                    kinds, row, ground[k, j, i], by_label, by_wall,
                )  # fmt: skip
    return count
