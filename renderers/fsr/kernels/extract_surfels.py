"""Extract surfels from a signed distance field: discs on its zero surface.

Normals point against the gradient: to lower density, towards the air.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from renderers.fsr.kernels.array_types import (
    F32,
    F64,
    I32,
    I64,
    U8,
    U16,
    Flags,
    Lanes,
)
from renderers.fsr.kernels.gradients import FlatVolume, sobel

SETTLED = 1.0
"""Voxels along an axis that Newton's steps must lead less than away from an element for
it to depend on no value farther than `MARGIN` from there."""

MARGIN = 2.5
"""Voxels: in the last of the cells that steps of less than one voxel end in, Sobel's
neighbours are two voxels from an element on a voxel, and 2.5 from one between two."""


class GradientCache(NamedTuple):
    """Sobel sums of part of a volume, each found when it is first asked for.

    Plane k of the volume is kept in plane ``k % planes``, of which there are a power of
    two. sums: ``(planes, rows, columns, 3)``. tags: ``(planes, rows, columns)``, whose
    plane k a sum is of; -1 at
    first. first_i, first_j: the volume's column and row in the first of these.
    """

    sums: F32
    tags: I32
    first_i: int
    first_j: int


class FoundSurfels(NamedTuple):
    """Take surfels as they are found.

    x: columns on the element grid. position, normal: see `Surfels`. far: ``(m, 4)``
    elements whose steps led to `SETTLED` or farther, whether they gave a surfel or
    not: column, row, plane and the voxels that they were led, rounded up.
    """

    x: U16
    position: F32
    normal: F32
    far: I64


class FoundBlocks(NamedTuple):
    """Take the surfels of blocks: how many each has, and in how many of its rows."""

    counts: I64
    rows: I64


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _trilinear(
    values: F32, nx: int, ny: int, x: float, y: float, z: float, i: int, j: int, k: int,
) -> tuple[Lanes, Lanes, Lanes, Lanes]:  # fmt: skip
    """Interpolate a cell; return the value and its derivatives along x, y, z."""
    fx = x - i
    fy = y - j
    fz = z - k
    n = (k * ny + j) * nx + i
    p = nx * ny
    v000, v100 = values[n], values[n + 1]
    v010, v110 = values[n + nx], values[n + nx + 1]
    v001, v101 = values[n + p], values[n + p + 1]
    v011, v111 = values[n + p + nx], values[n + p + nx + 1]
    a = v000 + fx * (v100 - v000)
    b = v010 + fx * (v110 - v010)
    c = v001 + fx * (v101 - v001)
    d = v011 + fx * (v111 - v011)
    e = a + fy * (b - a)
    f = c + fy * (d - c)
    dx0 = (v100 - v000) + fy * ((v110 - v010) - (v100 - v000))
    dx1 = (v101 - v001) + fy * ((v111 - v011) - (v101 - v001))
    dy = (b - a) + fz * ((d - c) - (b - a))
    return e + fz * (f - e), dx0 + fz * (dx1 - dx0), dy, f - e


THIN_SLOPE_2 = 0.8
"""Squared slope of a distance field below which its argument lies near the middle of a
thin wall; elsewhere a swept field has .85 to 1.12, squared .72 to 1.25."""


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _level(
    values: F32, nx: int, ny: int, nz: int, x: float, y: float, z: float
) -> Lanes:
    """Interpolate trilinearly; beyond the grid its last cell goes on."""
    i = min(max(math.floor(x), 0), nx - 2)
    j = min(max(math.floor(y), 0), ny - 2)
    k = min(max(math.floor(z), 0), nz - 2)
    return _trilinear(values, nx, ny, x, y, z, i, j, k)[0]


LAYER = 0.7072
"""Spacings of the element grid that the surface passes an element within, at most."""

REACH = 2.0
"""Spacings of the grid; the field is farther from zero where no element is near it."""


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _may_hold(
    values: F32, nx: int, ny: int, nz: int, i: int, j: int, k: int, reach: float,
    layer: float,
) -> bool:  # fmt: skip
    """True if elements in a voxel's cell may belong to the set.

    reach: beyond it (mm) no element is looked at, since a field of distances changes by
    less than its arguments. layer: farthest (mm) of the surface from an element.
    """
    if abs(values[(k * ny + j) * nx + i]) > reach:
        return False
    n = (min(k, nz - 2) * ny + min(j, ny - 2)) * nx + min(i, nx - 2)
    p = nx * ny
    a, b, c, d = values[n], values[n + 1], values[n + nx], values[n + nx + 1]
    e, f, g, h = (
        values[n + p],
        values[n + p + 1],
        values[n + p + nx],
        values[n + p + nx + 1],
    )
    low = min(min(min(a, b), min(c, d)), min(min(e, f), min(g, h)))
    high = max(max(max(a, b), max(c, d)), max(max(e, f), max(g, h)))
    # what is interpolated may be out of these by a rounding
    slack = 1e-5 * (high - low)
    return not (low - slack > layer or high + slack < -layer)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _settle(
    values: F32, nx: int, ny: int, nz: int, sx: float, sy: float, sz: float,
    refine: int, ei: int, ej: int, ek: int,
) -> tuple[bool, float, float, float, float]:  # fmt: skip
    """Return if an element belongs to the set, its place in voxels and its way there.

    sx, sy, sz: the spacing. An element belongs to the set when the zero surface passes
    within half a spacing of it, measured along the normal: one layer of elements,
    whatever the orientation. It is moved to the zero of the trilinear field by Newton
    steps along the gradient. The way is the largest that it was from where it began,
    along any axis, in voxels; 0 for what does not belong.
    """
    hx = sx / refine
    hy = sy / refine
    hz = sz / refine
    px = ei / refine
    py = ej / refine
    pz = ek / refine
    x0, y0, z0 = px, py, pz
    a = min(int(px), nx - 2)
    b = min(int(py), ny - 2)
    c = min(int(pz), nz - 2)
    d, gx, gy, gz = _trilinear(values, nx, ny, px, py, pz, a, b, c)
    # the least that the test below asks of any slope
    if abs(d) > LAYER * max(hx, hy, hz):
        return False, px, py, pz, 0.0
    # The slope of one cell may be that of the wrong side: in a narrow cleft the
    # cell beside the wall slopes and its neighbour in the middle does not.
    step = 0.5 / refine
    u = _level(values, nx, ny, nz, px + step, py, pz)
    gx = (u - _level(values, nx, ny, nz, px - step, py, pz)) / hx
    u = _level(values, nx, ny, nz, px, py + step, pz)
    gy = (u - _level(values, nx, ny, nz, px, py - step, pz)) / hy
    u = _level(values, nx, ny, nz, px, py, pz + step)
    gz = (u - _level(values, nx, ny, nz, px, py, pz - step)) / hz
    g2 = gx * gx + gy * gy + gz * gz
    if not g2 > 1e-12:
        return False, px, py, pz, 0.0
    slab = (hx * gx) ** 2 + (hy * gy) ** 2 + (hz * gz) ** 2
    # |d| <= sqrt(slab) / |g| / 2: the direction is taken from the slope, the
    # distance from the field. In a thin wall the slope flattens towards the
    # middle; dividing by it would leave out the surface of the wall. There
    # the direction is uncertain too, so the layer is taken thicker.
    layer = 2.0 * slab if g2 < THIN_SLOPE_2 else slab
    if 4.0 * d * d * g2 > layer:
        return False, px, py, pz, 0.0
    way = 0.0
    # six divisions a step would take longer than all the rest of it
    rx, ry, rz = 1.0 / sx, 1.0 / sy, 1.0 / sz
    for _ in range(3):
        s = d / g2
        px -= s * gx * rx
        py -= s * gy * ry
        pz -= s * gz * rz
        way = max(max(way, abs(px - x0)), max(abs(py - y0), abs(pz - z0)))
        a = min(max(math.floor(px), 0), nx - 2)
        b = min(max(math.floor(py), 0), ny - 2)
        c = min(max(math.floor(pz), 0), nz - 2)
        d, gx, gy, gz = _trilinear(values, nx, ny, px, py, pz, a, b, c)
        gx *= rx
        gy *= ry
        gz *= rz
        g2 = max(gx * gx + gy * gy + gz * gz, 1e-12)
    return True, px, py, pz, way


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _gradient_at(
    values: F32, nx: int, ny: int, nz: int, half: F32, sums: F32, tags: I32,
    corner: tuple[int, int], px: float, py: float, pz: float,
) -> tuple[float, float, float]:  # fmt: skip
    """Interpolate Sobel's gradient at a place in voxels, along the grid's axes.

    sums, tags, corner: of a `GradientCache`.
    """
    a = min(max(math.floor(px), 0), nx - 2)
    b = min(max(math.floor(py), 0), ny - 2)
    c = min(max(math.floor(pz), 0), nz - 2)
    gx = 0.0
    gy = 0.0
    gz = 0.0
    for n in range(8):
        o = n & 1
        p = n >> 1 & 1
        q = n >> 2
        w = (
            (px - a if o else 1 - (px - a))
            * (py - b if p else 1 - (py - b))
            * (pz - c if q else 1 - (pz - c))
        )
        i = a + o - corner[0]
        j = b + p - corner[1]
        k = (c + q) & (sums.shape[0] - 1)
        kept = 0 <= i < sums.shape[2] and 0 <= j < sums.shape[1]
        if kept and tags[k, j, i] == c + q:
            sx, sy, sz = sums[k, j, i, 0], sums[k, j, i, 1], sums[k, j, i, 2]
        else:
            sx, sy, sz = sobel(values, nx, ny, nz, a + o, b + p, c + q)
            if kept:
                sums[k, j, i, 0], sums[k, j, i, 1], sums[k, j, i, 2] = sx, sy, sz
                tags[k, j, i] = c + q
        gx += w * sx * half[0]
        gy += w * sy * half[1]
        gz += w * sz * half[2]
    return gx, gy, gz


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _put(
    world_from_voxel: F64, direction: F64, position: F32, normal: F32, n: int,
    px: float, py: float, pz: float, gx: float, gy: float, gz: float,
) -> bool:  # fmt: skip
    """Write a surfel from its place and gradient; False where there is no normal."""
    length = math.sqrt(gx * gx + gy * gy + gz * gz)
    if not length > 1e-6:
        return False
    r = -1.0 / length
    for m in range(3):
        position[n, m] = (
            world_from_voxel[m, 0] * px
            + world_from_voxel[m, 1] * py
            + world_from_voxel[m, 2] * pz
        )
        normal[n, m] = r * (
            direction[m, 0] * gx + direction[m, 1] * gy + direction[m, 2] * gz
        )
    return True


class SurfelQuery(NamedTuple):
    """Where surfels are looked for.

    spacing: mm along x, y and z. world_from_voxel: ``(4, 4)``. direction: ``(3, 3)``,
    the axes in columns. refine: elements per voxel and axis. cache: Sobel sums, which
    are kept from look to look.
    """

    volume: FlatVolume
    spacing: tuple[float, float, float]
    world_from_voxel: F64
    direction: F64
    refine: int
    cache: GradientCache


@njit(cache=True, nogil=True, error_model="numpy")
def _find_in_box(
    look: SurfelQuery, holds: Flags, columns: int, first: tuple[int, int, int],
    rows: tuple[int, int], planes: tuple[int, int], found: FoundSurfels, n: int,
    far: int,
) -> tuple[int, int, int]:  # fmt: skip
    """Append the surfels of a box's elements, in the grid's order.

    holds: ``[k, j, i]``, voxels of the box that may hold some; of its columns the first
    `columns` count. first: column, row and plane of the first of these. rows, planes:
    of elements; first and end. n, far: surfels and elements in `found.far` so far.
    Returns how many there are then, and rows that have some. `found.x` takes columns if
    there is room for any.
    """
    values, nx, ny, nz, half, _ = look.volume
    sums, tags, refine = look.cache.sums, look.cache.tags, look.refine
    corner = look.cache.first_i, look.cache.first_j
    world_from_voxel, direction = look.world_from_voxel, look.direction
    x, position, normal, led = found
    sx, sy, sz = look.spacing
    ex = (nx - 1) * refine + 1
    keeps_x = x.shape[0] > 0
    full = 0
    for ek in range(planes[0], planes[1]):
        k = ek // refine - first[2]
        for ej in range(rows[0], rows[1]):
            j = ej // refine - first[1]
            before = n
            for i in range(columns):
                if not holds[k, j, i]:
                    continue
                at = (first[0] + i) * refine
                for ei in range(at, min(at + refine, ex)):
                    belongs, px, py, pz, way = _settle(
                        values, nx, ny, nz, sx, sy, sz, refine, ei, ej, ek
                    )
                    if not belongs:
                        continue
                    if way >= SETTLED:
                        led[far, 0], led[far, 1], led[far, 2] = ei, ej, ek
                        led[far, 3] = math.ceil(min(way, 1e6))
                        far += 1
                    gx, gy, gz = _gradient_at(
                        values, nx, ny, nz, half, sums, tags, corner, px, py, pz
                    )
                    if _put(
                        world_from_voxel, direction, position, normal, n, px, py, pz,
                        gx, gy, gz,
                    ):  # fmt: skip
                        if keeps_x:
                            x[n] = ei
                        n += 1
            full += n > before
    return n, far, full


@njit(cache=True, nogil=True, error_model="numpy")
def extract_surfel_rows(
    look: SurfelQuery, row: int, offsets: I64, found: FoundSurfels, far: int
) -> tuple[int, int]:
    """Append the surfels of rows `row`.. of a signed distance field.

    The element grid is the voxel grid refined `refine` times per axis; see `_settle`
    for which of its elements give surfels. These take the interpolated Sobel normal.
    far: elements listed in `found.far` so far. Returns the first row that did not fit,
    and far.
    """
    values, nx, ny, nz, _, _ = look.volume
    spacing, refine = look.spacing, look.refine
    ex = (nx - 1) * refine + 1
    ey = (ny - 1) * refine + 1
    ez = (nz - 1) * refine + 1
    widest = max(spacing[0], spacing[1], spacing[2])
    reach = REACH * widest
    layer = 1.000001 * LAYER * widest / refine
    holds = np.empty((1, 1, nx), np.bool_)
    is_first = True
    first = int(np.int64(0))  # see `extract_surfel_blocks`
    n = offsets[row]
    while row < ey * ez:
        if n + ex > found.x.shape[0] or far + ex > found.far.shape[0]:
            return row, far
        ek = row // ey
        ej = row - ek * ey
        j = ej // refine
        k = ek // refine
        if is_first or ej % refine == 0:
            is_first = False
            for i in range(nx):
                holds[0, 0, i] = _may_hold(values, nx, ny, nz, i, j, k, reach, layer)
        n, far, _ = _find_in_box(
            look, holds, nx, (first, j, k), (ej, ej + 1), (ek, ek + 1), found, n, far
        )
        row += 1
        offsets[row] = n
    return row, far


@njit(cache=True, nogil=True, error_model="numpy")
def extract_surfel_blocks(
    look: SurfelQuery, blocks: I64, edge: int, found: FoundSurfels, counted: FoundBlocks
) -> tuple[int, int]:
    """Find the surfels of blocks, block by block and in the grid's order within each.

    They are those of `extract_surfel_rows` to the bit. blocks: ``(b, 3)`` places (i, j,
    k) of blocks of `edge` elements a side. `found.x` has no room. Returns how many
    surfels and elements in `found.far` there are; -1, -1 where they do not fit.
    """
    values, nx, ny, nz, _, _ = look.volume
    spacing, refine = look.spacing, look.refine
    ey = (ny - 1) * refine + 1
    ez = (nz - 1) * refine + 1
    widest = max(spacing[0], spacing[1], spacing[2])
    reach = REACH * widest
    layer = 1.000001 * LAYER * widest / refine
    cells = edge // refine
    holds = np.empty((cells, cells, cells), np.bool_)
    # for literals numba would compile what is called with them once more
    n = far = int(np.int64(0))
    for block in range(blocks.shape[0]):
        if n + edge**3 > found.position.shape[0] or far + edge**3 > found.far.shape[0]:
            return -1, -1
        first = n
        rows = 0
        i0, j0, k0 = (
            cells * blocks[block, 0],
            cells * blocks[block, 1],
            cells * blocks[block, 2],
        )
        any_holds = False
        for k in range(k0, min(k0 + cells, nz)):
            for j in range(j0, min(j0 + cells, ny)):
                for i in range(i0, min(i0 + cells, nx)):
                    it = _may_hold(values, nx, ny, nz, i, j, k, reach, layer)
                    holds[k - k0, j - j0, i - i0] = it
                    any_holds |= it
        if any_holds:
            n, far, rows = _find_in_box(
                look,
                holds,
                min(cells, nx - i0),
                (i0, j0, k0),
                (j0 * refine, min((j0 + cells) * refine, ey)),
                (k0 * refine, min((k0 + cells) * refine, ez)),
                found,
                n,
                far,
            )
        counted.counts[block] = n - first
        counted.rows[block] = rows
    return n, far


@njit(cache=True, nogil=True, error_model="numpy")
def mark_blocks(
    values: F32, before: F32, low: I64, high: I64, edge: int, first: I64, marks: U8,
) -> None:  # fmt: skip
    """Mark blocks that depend on what is different, and take it over.

    values, before: ``[z, y, x]``, equal outside the voxels low..high. edge: voxels
    along a side of a block. first: place (i, j, k) of the first block of `marks`, which
    holds all that may depend on voxels low..high.
    """
    margin = int(2 * MARGIN)
    size = 2 * edge
    nz, ny, nx = marks.shape
    for k in range(low[2], high[2] + 1):
        for j in range(low[1], high[1] + 1):
            for i in range(low[0], high[0] + 1):
                if values[k, j, i] == before[k, j, i]:
                    continue
                before[k, j, i] = values[k, j, i]
                # in halves of a voxel
                a = max((2 * i - margin) // size - first[0], 0)
                b = max((2 * j - margin) // size - first[1], 0)
                c = max((2 * k - margin) // size - first[2], 0)
                a1 = min((2 * i + margin) // size - first[0], nx - 1)
                b1 = min((2 * j + margin) // size - first[1], ny - 1)
                c1 = min((2 * k + margin) // size - first[2], nz - 1)
                marks[c : c1 + 1, b : b1 + 1, a : a1 + 1] = 1


@njit(cache=True, nogil=True, error_model="numpy")
def move_runs(
    position: F32, normal: F32, begins: I64, counts: I64, to_position: F32,
    to_normal: F32, to: I64,
) -> None:  # fmt: skip
    """Copy runs of surfels, each of `counts` from `begins`, to other places `to`."""
    for run in range(begins.shape[0]):
        a, b = begins[run], to[run]
        for n in range(counts[run]):
            for m in range(3):
                to_position[b + n, m] = position[a + n, m]
                to_normal[b + n, m] = normal[a + n, m]
