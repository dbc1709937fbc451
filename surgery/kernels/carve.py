"""Take a tool's solids out of the tissue, and keep the books to the last count."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from surgery.kernels.solid_distance import balls_around, solids_distance_below

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
def _share(low: float, high: float, peak: float, upper: float) -> float:
    """Return the share of a voxel's tissue that lies above `upper`.

    Depths are even between `low` and `high`, and folded back at `peak`: what lies
    beyond the middle of a wall belongs to its other side. Less than 0 is air.
    """
    top, first, second = min(high, peak), max(low, 0.0), max(2.0 * peak - high, 0.0)
    whole = top - first
    above = min(max(upper - first, 0.0), whole)
    if high > peak:
        whole += peak - second
        above += min(max(upper - second, 0.0), peak - second)
    return above / max(whole, 1e-6)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _peak(distance: Floats, k: int, j: int, i: int, h: float) -> float:
    """Return how deep a wall is in its middle, if that is near a voxel.

    Along the axis that crosses the wall the depth is a tent. Its slope is that to the
    shallower neighbour; the deeper one stands on the same side or on the other.
    """
    nz, ny, nx = distance.shape
    here = distance[k, j, i]
    slope, deeper = -1.0, 0.0
    for axis in range(3):
        a, b, c = int(axis == 0), int(axis == 1), int(axis == 2)
        before = distance[max(k - c, 0), max(j - b, 0), max(i - a, 0)]
        after = distance[min(k + c, nz - 1), min(j + b, ny - 1), min(i + a, nx - 1)]
        falls = here - min(before, after)
        if falls > slope:
            slope, deeper = falls, max(before, after)
    peak: float = max(here, 0.5 * (here + deeper + min(slope, h)))
    return peak


@njit(cache=True, nogil=True, error_model="numpy")
def share_out(
    distance: Floats, wall: Bytes, layers: Floats, half: float, fill: Fill,
    flesh: Fill, bone: Fill,
) -> None:  # fmt: skip
    """Find how much of each voxel's fill is mucosa and how much is a wall's bone.

    half: half a voxel's edge, mm. The voxel's depths are the interval around its
    middle's; a plate thinner than that has its own share of it.
    """
    for k in range(distance.shape[0]):
        for j in range(distance.shape[1]):
            for i in range(distance.shape[2]):
                full = int(fill[k, j, i])
                depth, row = distance[k, j, i], wall[k, j, i]
                mucosa, thick = layers[row, 0], layers[row, 1]
                flesh[k, j, i] = bone[k, j, i] = 0
                if full == 0 or depth - half >= mucosa + thick:
                    continue
                peak = _peak(distance, k, j, i, 2.0 * half)
                low, high = depth - half, depth + half
                outer = _share(low, high, peak, mucosa)
                both = _share(low, high, peak, mucosa + thick)
                first = math.floor(full * outer + 0.5)
                flesh[k, j, i] = first
                bone[k, j, i] = math.floor(full * both + 0.5) - first


@njit(cache=True, nogil=True, error_model="numpy")
def book(
    fills: tuple[Fill, Fill, Fill], k: int, j: int, i: int, now: int, is_bared: bool,
    labels: Bytes, row: int, ground: int, books: tuple[Longs, Longs],
) -> None:  # fmt: skip
    """Lower a voxel's fill and put what it lost into the books.

    fills: all of the voxel, and of that its mucosa and its wall's bone. What was cut
    through is lost in proportion; what was bared is lost from the outermost layer
    inwards. labels: ``(2,)`` of mucosa and bone.
    """
    fill, flesh, bone = fills
    by_label, by_wall = books
    was = int(fill[k, j, i])
    if now >= was:
        return
    taken = was - now
    outer, inner = int(flesh[k, j, i]), int(bone[k, j, i])
    first, second = outer, inner
    if not is_bared:
        first = outer - outer * now // was
        second = inner - inner * now // was
    first = min(first, taken)
    second = min(second, taken - first)
    fill[k, j, i] = now
    flesh[k, j, i] = outer - first
    bone[k, j, i] = inner - second
    by_label[labels[0]] += first
    by_label[labels[1]] += second
    by_label[ground] += taken - first - second
    by_wall[row] += second


@njit(cache=True, nogil=True, error_model="numpy")
def carve(
    distance: Floats, fills: tuple[Fill, Fill, Fill], pristine: Floats,
    walls: tuple[Bytes, Bytes], tables: tuple[Floats, Floats, Bytes, Bytes],
    rows: Doubles, grid: Doubles, reach: float, box: Longs,
    books: tuple[Longs, Longs], bounds: Longs,
) -> int:  # fmt: skip
    """Carve a box: distance becomes the lesser of itself and the tool's.

    distance, fills: mutable, see `book`; pristine: not. walls: row of the wall, and
    ground label. tables: ``(256, 2)`` mucosa and bone thickness by row; ``(256,)``
    depth that may be taken by row, +inf for all; ``(256,)`` 1 for grounds that are too
    hard; ``(256, 2)`` labels by row. rows: solids. grid: ``(5, 3)`` float64: origin,
    columns of the axes times their spacing as rows, and spacing. reach: farther from
    the solids, mm, nothing changes. box: i0 j0 k0 i1 j1 k1, ends excluded. books:
    counts by label and by wall. bounds: ``(6,)``, first and last changed voxel. Returns
    the number of voxels that changed.
    """
    wall, ground = walls
    layers, spared, hard, kinds = tables
    h = max(grid[4, 0], max(grid[4, 1], grid[4, 2]))
    per_mm = 1.0 / h
    balls = balls_around(rows)
    bounds[:3] = 1 << 30
    bounds[3:] = -1
    count = 0
    for k in range(box[2], box[5]):
        for j in range(box[1], box[4]):
            for i in range(box[0], box[3]):
                x = grid[0, 0] + i * grid[1, 0] + j * grid[2, 0] + k * grid[3, 0]
                y = grid[0, 1] + i * grid[1, 1] + j * grid[2, 1] + k * grid[3, 1]
                z = grid[0, 2] + i * grid[1, 2] + j * grid[2, 2] + k * grid[3, 2]
                old = distance[k, j, i]
                limit = min(float(old), reach)
                s = solids_distance_below(x, y, z, rows, balls, limit)
                if not s < limit:
                    continue
                row, below = wall[k, j, i], ground[k, j, i]
                depth = pristine[k, j, i]
                mucosa, bone = layers[row, 0], layers[row, 1]
                least = spared[row]
                if hard[below]:
                    least = min(least, mucosa + bone)
                # a tool that spares a wall's bone takes none of it, at its rim neither
                is_bared = spared[row] < 1e6
                if float(depth) - least > s:
                    s = float(depth) - least
                    is_bared = True
                new = np.float32(s)
                if not new < old:
                    continue
                distance[k, j, i] = new
                count += 1
                bounds[0], bounds[3] = min(bounds[0], i), max(bounds[3], i)
                bounds[1], bounds[4] = min(bounds[1], j), max(bounds[4], j)
                bounds[2], bounds[5] = min(bounds[2], k), max(bounds[5], k)
                now = filled(float(new), per_mm)
                book(fills, k, j, i, now, is_bared, kinds[row], row, below, books)
    return count


@njit(cache=True, nogil=True, error_model="numpy")
def clear_pieces(
    distance: Floats, fills: tuple[Fill, Fill, Fill], walls: tuple[Bytes, Bytes],
    kinds: Bytes, loose: Bytes, box: Longs, h: float, books: tuple[Longs, Longs],
) -> int:  # fmt: skip
    """Make air of the voxels that are marked as loose pieces; returns their number.

    loose: over the box. Other arrays as in `carve`.
    """
    wall, ground = walls
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
                row, below = wall[k, j, i], ground[k, j, i]
                book(fills, k, j, i, 0, False, kinds[row], row, below, books)
    return count
