"""Cells of the surface that blood lies on: where they are and how they are joined.

A cell is a voxel of air with a face neighbour in tissue. Of a plane, that is one voxel
in each column along the axis that is steepest to it, so the surface that a cell stands
for is known: a column's section over the cosine to the normal. Cells are made when
blood first reaches them; they lie in a pool and are found by their voxel.

Lengths are mm in the frame of the grid's axes, origin in the first voxel.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

Bytes = NDArray[np.uint8]
Floats = NDArray[np.float32]
Doubles = NDArray[np.float64]
Ints = NDArray[np.int32]
Longs = NDArray[np.int64]

PER_MM3 = 1e6
"""Units of volume in a cubic millimetre."""

LINKS = 8
"""Neighbours of a cell at most: as many as a plane has."""

VISCOUS = 990.5
"""rho g / (3 mu) of blood, 1/(mm s): 1060 kg/m3 and 3.5 mPa s."""

BIN_MM = 0.02
"""Blood runs on by gravity alone where the next cell lies lower by this."""

# columns of a cell's shape
HEIGHT, AREA, UP, SHARE, RATE, THIN = range(6)
# and of its marks
EXIT, AXIS, FIRST, SECOND = range(4)

NO_EXIT, NOSTRIL, THROAT, BORDER = range(4)

LEAST_UP = 0.2
"""Cosine below which a steep wall counts as one that rises so much."""

UNKNOWN = -2
"""Place where a drop lands before it was looked for; -1 is outside."""


class Ground(NamedTuple):
    """What cells are made from: the grid, the distance, gravity, the ways out.

    distance: ``(nz, ny, nx)`` mm, negative in air. spacing, gravity: ``(3,)`` along
    x, y, z of the array; gravity is a unit vector. lowest: height of the lowest corner,
    mm against gravity. exits: of voxels, or of shape (1, 1, 1) where none are known.
    """

    distance: Floats
    spacing: Doubles
    gravity: Doubles
    lowest: float
    exits: Bytes


class Cells(NamedTuple):
    """The pool of cells; the first `used[0]` rows are in use.

    used: ``(1,)``. slot: of a voxel its row + 1, or 0. voxel: flat. volume, delta,
    before: in `surgery.film.UNIT_MM3`. shape, marks: see the columns above; SHARE goes
    to the link FIRST, the rest to SECOND; THIN is the
    thickness of a unit of volume. links: voxels, -1 for none. beside: their rows, -1
    where no cell was made: the table of voxels is larger than any cache. drops: how
    much lower a link's cell lies, mm, and one over the square of the way to it.
    landing: voxel below. told: thickness that was drawn. next, queued: of the sweep.
    head: how much higher blood stands than the surface, mm. wide: area from above, mm2.
    """

    used: Longs
    slot: Ints
    voxel: Ints
    volume: Longs
    delta: Longs
    before: Longs
    shape: Floats
    marks: Bytes
    links: Ints
    beside: Ints
    drops: Floats
    landing: Ints
    told: Ints
    next: Ints
    queued: Longs
    head: Doubles
    wide: Doubles


@njit(cache=True, nogil=True, error_model="numpy")
def is_cell(d: Floats, i: int, j: int, k: int) -> bool:
    """Tell whether a voxel is air beside tissue."""
    nz, ny, nx = d.shape
    if d[k, j, i] > 0:
        return False
    return bool(
        (i > 0 and d[k, j, i - 1] > 0)
        or (i < nx - 1 and d[k, j, i + 1] > 0)
        or (j > 0 and d[k, j - 1, i] > 0)
        or (j < ny - 1 and d[k, j + 1, i] > 0)
        or (k > 0 and d[k - 1, j, i] > 0)
        or (k < nz - 1 and d[k + 1, j, i] > 0)
    )


@njit(cache=True, nogil=True, error_model="numpy")
def surface_at(
    ground: Ground, i: int, j: int, k: int
) -> tuple[float, float, float, float, float, float]:
    """Return the surface's point next to a cell, mm, and its unit normal to the air."""
    d, s = ground.distance, ground.spacing
    nz, ny, nx = d.shape
    a, b = max(i - 1, 0), min(i + 1, nx - 1)
    gx = (d[k, j, b] - d[k, j, a]) / ((b - a) * s[0])
    a, b = max(j - 1, 0), min(j + 1, ny - 1)
    gy = (d[k, b, i] - d[k, a, i]) / ((b - a) * s[1])
    a, b = max(k - 1, 0), min(k + 1, nz - 1)
    gz = (d[b, j, i] - d[a, j, i]) / ((b - a) * s[2])
    long = math.sqrt(gx * gx + gy * gy + gz * gz)
    if long < 1e-6:
        return i * s[0], j * s[1], k * s[2], 0.0, 0.0, 0.0
    gx, gy, gz = -gx / long, -gy / long, -gz / long
    # a safe bound may be far too deep: the surface lies within the next voxel
    way = max(float(d[k, j, i]), -max(s[0], max(s[1], s[2])))
    return i * s[0] + way * gx, j * s[1] + way * gy, k * s[2] + way * gz, gx, gy, gz


@njit(cache=True, nogil=True, error_model="numpy")
def shape_cell(ground: Ground, cells: Cells, row: int) -> None:
    """Find all that a cell's place decides: height, area, links, where it runs to."""
    d, s, g = ground.distance, ground.spacing, ground.gravity
    nz, ny, nx = d.shape
    voxel = cells.voxel[row]
    i, j, k = voxel % nx, voxel // nx % ny, voxel // (nx * ny)
    x, y, z, u, v, w = surface_at(ground, i, j, k)
    shape, marks = cells.shape[row], cells.marks[row]
    height = -(x * g[0] + y * g[1] + z * g[2])
    up = -(u * g[0] + v * g[1] + w * g[2])
    steep = (abs(u) * s[0], abs(v) * s[1], abs(w) * s[2])
    axis = 0
    if steep[1] > steep[0]:
        axis = 1
    if steep[2] > steep[axis]:
        axis = 2
    cosine = max(steep[axis] / s[axis], 0.5)
    shape[HEIGHT], shape[UP] = height, up
    shape[AREA] = s[0] * s[1] * s[2] / s[axis] / cosine
    shape[SHARE], shape[RATE] = 0.0, 0.0
    shape[THIN] = 1.0 / (PER_MM3 * shape[AREA])
    cells.wide[row] = shape[AREA] * max(float(shape[UP]), LEAST_UP)
    marks[AXIS], marks[FIRST], marks[SECOND] = axis, 255, 255
    marks[EXIT] = NO_EXIT
    if ground.exits.size > 1:
        marks[EXIT] = ground.exits[k, j, i]
    if i == 0 or j == 0 or k == 0 or i == nx - 1 or j == ny - 1 or k == nz - 1:
        marks[EXIT] = BORDER
    cells.landing[row] = UNKNOWN
    # gravity along the surface, and across it
    tx, ty, tz = g[0] + up * u, g[1] + up * v, g[2] + up * w
    sine = math.sqrt(tx * tx + ty * ty + tz * tz)
    if sine > 0.02:
        tx, ty, tz = tx / sine, ty / sine, tz / sine
    cx, cy, cz = v * tz - w * ty, w * tx - u * tz, u * ty - v * tx
    links, drops = cells.links[row], cells.drops[row]
    links[:] = -1
    count = 0
    left, right = np.inf, np.inf
    left_along, right_along, left_off, right_off = 0.0, 0.0, 0.0, 0.0
    # nearest first: faces, edges, corners
    for ring in range(1, 4):
        for n in range(27):
            a, b, c = n % 3 - 1, n // 3 % 3 - 1, n // 9 - 1
            if abs(a) + abs(b) + abs(c) != ring or count == LINKS:
                continue
            p, q, r = i + a, j + b, k + c
            if p < 0 or q < 0 or r < 0 or p >= nx or q >= ny or r >= nz:
                continue
            if not is_cell(d, p, q, r):
                continue
            px, py, pz, pu, pv, pw = surface_at(ground, p, q, r)
            if u * pu + v * pv + w * pw < -0.5:
                # the wall across a slit
                continue
            px, py, pz = px - x, py - y, pz - z
            drop = px * g[0] + py * g[1] + pz * g[2]
            square = px * px + py * py + pz * pz
            links[count] = (r * ny + q) * nx + p
            drops[count, 0] = drop
            drops[count, 1] = 1.0 / max(square, 0.05 * s[axis] * s[axis])
            along = px * tx + py * ty + pz * tz
            off = px * cx + py * cy + pz * cz
            if sine > 0.02 and drop >= BIN_MM and along > 0.2 * s[axis]:
                lean = abs(off) / along
                if off >= 0 and lean < left:
                    left, left_along, left_off = lean, along, off
                    marks[FIRST] = count
                elif off < 0 and lean < right:
                    right, right_along, right_off = lean, along, -off
                    marks[SECOND] = count
            count += 1
    if marks[EXIT] != NO_EXIT:
        # it gets out here, and runs no farther
        marks[FIRST], marks[SECOND] = 255, 255
    if marks[FIRST] == 255 and marks[SECOND] == 255:
        return
    # two cells on either side of steepest descent share so that the mean goes along it
    if marks[FIRST] == 255:
        share = 0.0
    elif marks[SECOND] == 255:
        share = 1.0
    else:
        share = right_off / (left_off + right_off)
    shape[SHARE] = share
    way = share * left_along + (1.0 - share) * right_along
    shape[RATE] = VISCOUS * sine / way


@njit(cache=True, nogil=True, error_model="numpy")
def find_beside(cells: Cells, row: int) -> None:
    """Look up the rows of a cell's neighbours."""
    for link in range(LINKS):
        voxel = cells.links[row, link]
        cells.beside[row, link] = cells.slot[voxel] - 1 if voxel >= 0 else -1


@njit(cache=True, nogil=True, error_model="numpy")
def _join(cells: Cells, shape: tuple[int, int, int], row: int) -> None:
    """Join a new cell to its neighbours, and them to it."""
    find_beside(cells, row)
    nz, ny, nx = shape
    voxel = cells.voxel[row]
    i, j, k = voxel % nx, voxel // nx % ny, voxel // (nx * ny)
    for n in range(27):
        p, q, r = i + n % 3 - 1, j + n // 3 % 3 - 1, k + n // 9 - 1
        if p < 0 or q < 0 or r < 0 or p >= nx or q >= ny or r >= nz:
            continue
        other = int(cells.slot[(r * ny + q) * nx + p]) - 1
        if other >= 0:
            for link in range(LINKS):
                if cells.links[other, link] == voxel:
                    cells.beside[other, link] = row


@njit(cache=True, nogil=True, error_model="numpy")
def cell_of(ground: Ground, cells: Cells, voxel: int) -> int:
    """Return the row of a voxel's cell, made if need be; -1 where the pool is full."""
    row = int(cells.slot[voxel]) - 1
    if row >= 0:
        return row
    row = int(cells.used[0])
    if row == cells.voxel.size:
        return -1
    cells.used[0] = row + 1
    cells.slot[voxel] = row + 1
    cells.voxel[row] = voxel
    cells.volume[row] = 0
    cells.delta[row] = 0
    cells.before[row] = 0
    cells.told[row] = 0
    cells.queued[row] = -1
    cells.head[row] = 0.0
    shape_cell(ground, cells, row)
    _join(cells, ground.distance.shape, row)
    return row


@njit(cache=True, nogil=True, error_model="numpy")
def nearest_cell(d: Floats, i: int, j: int, k: int, reach: int) -> int:
    """Return the flat voxel of the nearest cell at most `reach` voxels off, or -1."""
    nz, ny, nx = d.shape
    best, found = 1 << 30, -1
    for c in range(max(k - reach, 0), min(k + reach, nz - 1) + 1):
        for b in range(max(j - reach, 0), min(j + reach, ny - 1) + 1):
            for a in range(max(i - reach, 0), min(i + reach, nx - 1) + 1):
                far = (a - i) ** 2 + (b - j) ** 2 + (c - k) ** 2
                if far < best and is_cell(d, a, b, c):
                    best, found = far, (c * ny + b) * nx + a
    return found


@njit(cache=True, nogil=True, error_model="numpy")
def land(ground: Ground, voxel: int) -> int:
    """Return the voxel of the cell below a voxel of air, -1 where a drop gets out.

    The drop leaves the surface by a voxel before it falls.
    """
    d, s, g = ground.distance, ground.spacing, ground.gravity
    nz, ny, nx = d.shape
    i, j, k = voxel % nx, voxel // nx % ny, voxel // (nx * ny)
    x, y, z, u, v, w = surface_at(ground, i, j, k)
    h = max(s[0], max(s[1], s[2]))
    x, y, z = x + 1.2 * h * u, y + 1.2 * h * v, z + 1.2 * h * w
    while True:
        i, j, k = round(x / s[0]), round(y / s[1]), round(z / s[2])
        if i < 0 or j < 0 or k < 0 or i >= nx or j >= ny or k >= nz:
            return -1
        if d[k, j, i] > 0:
            return nearest_cell(d, i, j, k, 3)
        step = 0.5 * h
        x, y, z = x + step * g[0], y + step * g[1], z + step * g[2]


@njit(cache=True, nogil=True, error_model="numpy")
def reshape_cells(ground: Ground, cells: Cells, low: Longs, high: Longs) -> int:
    """Bring cells within a box of voxels up to date; returns the volume that got out.

    Blood on a voxel that is no surface any more goes to the nearest cell at most four
    voxels off, or falls. Such rows get voxel -1; the caller closes the gaps.
    """
    d = ground.distance
    _, ny, nx = d.shape
    lost = 0
    for row in range(cells.used[0]):
        voxel = cells.voxel[row]
        i, j, k = voxel % nx, voxel // nx % ny, voxel // (nx * ny)
        if cells.landing[row] >= -1:
            # what it drips on may be gone
            cells.landing[row] = UNKNOWN
        if (
            i < low[0] or j < low[1] or k < low[2]
            or i > high[0] or j > high[1] or k > high[2]
        ):  # fmt: skip
            continue
        if is_cell(d, i, j, k):
            shape_cell(ground, cells, row)
            continue
        volume = cells.volume[row]
        cells.volume[row] = 0
        cells.slot[voxel] = 0
        cells.voxel[row] = -1
        if volume == 0:
            continue
        to = nearest_cell(d, i, j, k, 4)
        if to < 0:
            to = land(ground, voxel)
        other = -1 if to < 0 else cell_of(ground, cells, to)
        if other < 0:
            lost += volume
        else:
            cells.volume[other] += volume
    # links reach a voxel beyond the box
    for row in range(cells.used[0]):
        voxel = cells.voxel[row]
        i, j, k = voxel % nx, voxel // nx % ny, voxel // (nx * ny)
        if (
            voxel >= 0
            and low[0] - 1 <= i <= high[0] + 1
            and low[1] - 1 <= j <= high[1] + 1
            and low[2] - 1 <= k <= high[2] + 1
        ):
            find_beside(cells, row)
    return lost
