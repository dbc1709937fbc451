"""Surfels into a G-buffer, tile by tile, sixteen pixels at a time.

A surfel is the tangent disc ``|p - c| < r`` of the plane ``n.(p - c) = 0``. On the ray
with unit direction w the plane lies at depth ``t = 1 / q``, ``q = w . n / (n.c)``,
linear in w, so depth is exact on planes. Since w has length 1, ``|p - c|^2`` is ``t^2 -
2 t w.c + c^2``. With ``s = w . 2 c / r^2`` and ``k = c^2 / r^2 - 1`` the disc is ``q (s
- q k) > 1 / r^2``: whether it hides is asked without a division; and the root of a
weight is ``t (s - t / r^2) - k``.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from renderers.fsr.kernels.array_types import F32, I32, I64, Real
from renderers.fsr.kernels.list_surfels import is_hidden, list_squares, list_tile
from renderers.fsr.kernels.project_surfels import RECORD
from renderers.fsr.kernels.surfel_tiles import (
    BLOCK_SQUARES,
    BLOCKS_X,
    BLOCKS_Y,
    RAY,
    SIDE,
    SPARE_SQUARES,
    SQUARE,
    SQUARES,
    SQUARES_X,
    SUMS,
    TILE_HEIGHT,
    TILE_WIDTH,
)
from renderers.simd import (
    count,
    full,
    least,
    load,
    maximum,
    minimum,
    select,
    sqrt,
    store,
    store_groups,
    store_triples,
)
from renderers.simd.atomics import fetch_add

_ONE = np.float32(1)
_ZERO = np.float32(0)


class Discs(NamedTuple):
    """Projected surfels and what makes discs of them.

    records, boxes: see `SurfelBuffers`; records flat. inverses: one over the squared
    radius, of the surfels before `split` and of the others. core: squared share of the
    radius that hides what lies behind. behind: depth in mm behind the nearest core that
    still counts. refresh: surfels between two looks at a tile's farthest depths.
    """

    records: F32
    boxes: I32
    split: int
    inverses: F32
    core: np.float32
    behind: np.float32
    refresh: int


class SurfelScratch(NamedTuple):
    """A tile's surfels, nearest cores and sums.

    items: ``(n,)`` which surfels. until: where the squares of each end in `squares`,
    which holds more than `SPARE_SQUARES`. nearest: a value a pixel. sums: five a pixel.
    far: one a block. starts, ends: one a row of squares.
    """

    items: I32
    until: I32
    squares: I32
    nearest: F32
    sums: F32
    far: F32
    starts: I32
    ends: I32


class GeometryPlanes(NamedTuple):
    """The geometry of a G-buffer."""

    depth: F32
    normal: F32
    coverage: F32


@njit(cache=True, nogil=True, error_model="numpy")
def _write_cut_squares(sums: F32, left: int, top: int, surface: GeometryPlanes) -> None:
    """Write the resolved squares of a tile that the picture's edges cut."""
    depth, normal, coverage = surface
    height, width = depth.shape
    for y in range(top, min(top + TILE_HEIGHT, height)):
        for x in range(left, min(left + TILE_WIDTH, width)):
            right, bottom = x // SIDE * SIDE + SIDE, y // SIDE * SIDE + SIDE
            if right <= width and bottom <= height:
                continue
            b, a = y - top, x - left
            at = (b // SIDE * SQUARES_X + a // SIDE) * SUMS + b % SIDE * SIDE + a % SIDE
            coverage[y, x] = sums[at]
            depth[y, x] = sums[at + SQUARE]
            for c in range(3):
                normal[y, x, c] = sums[at + (c + 2) * SQUARE]


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _refresh(nearest: F32, far: F32) -> None:
    """Take the least q of every block."""
    for by in range(BLOCKS_Y):
        for bx in range(BLOCKS_X):
            low = full(np.float32(np.inf), SQUARE)
            for y in range(by * BLOCK_SQUARES, (by + 1) * BLOCK_SQUARES):
                at = (y * SQUARES_X + bx * BLOCK_SQUARES) * SQUARE
                for x in range(BLOCK_SQUARES):
                    low = minimum(load(nearest, at + x * SQUARE, SQUARE), low)
            far[by * BLOCKS_X + bx] = least(low)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _hide(
    records: F32, o: int, inverse: Real, core: Real, rays: F32, nearest: F32,
    squares: I32, begin: int, end: int,
) -> None:  # fmt: skip
    """Keep the nearest q under the core in the squares listed at `begin`..`end`."""
    cx, cy, cz = records[o], records[o + 1], records[o + 2]
    mx, my, mz = records[o + 3], records[o + 4], records[o + 5]
    rest = records[o + 15] + (_ONE - core)
    for i in range(begin, end):
        k = squares[i]
        rx = load(rays, k * RAY, SQUARE)
        ry = load(rays, k * RAY + SQUARE, SQUARE)
        rz = load(rays, k * RAY + 2 * SQUARE, SQUARE)
        q = rx * mx + ry * my + rz * mz
        s = rx * cx + ry * cy + rz * cz
        old = load(nearest, k * SQUARE, SQUARE)
        under = q * (s - q * rest) > inverse
        store(nearest, k * SQUARE, select(under, maximum(q, old), old))


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _add(
    records: F32, o: int, inverse: Real, rays: F32, limits: F32, sums: F32,
    squares: I32, begin: int, end: int,
) -> None:  # fmt: skip
    """Sum weight, depth and normal in the listed squares, up to the depth limit."""
    cx, cy, cz = records[o], records[o + 1], records[o + 2]
    mx, my, mz = records[o + 3], records[o + 4], records[o + 5]
    nx, ny, nz = records[o + 6], records[o + 7], records[o + 8]
    rest = records[o + 15]
    for i in range(begin, end):
        k = squares[i]
        rx = load(rays, k * RAY, SQUARE)
        ry = load(rays, k * RAY + SQUARE, SQUARE)
        rz = load(rays, k * RAY + 2 * SQUARE, SQUARE)
        t = _ONE / (rx * mx + ry * my + rz * mz)
        s = rx * cx + ry * cy + rz * cz
        f = t * (s - t * inverse) - rest
        met = (f > _ZERO) & (t > _ZERO) & (t < load(limits, k * SQUARE, SQUARE))
        w = select(met, f * f, _ZERO)
        at = k * SUMS
        store(sums, at, load(sums, at, SQUARE) + w)
        at += SQUARE
        store(sums, at, load(sums, at, SQUARE) + select(met, w * t, _ZERO))
        at += SQUARE
        store(sums, at, load(sums, at, SQUARE) + w * nx)
        at += SQUARE
        store(sums, at, load(sums, at, SQUARE) + w * ny)
        at += SQUARE
        store(sums, at, load(sums, at, SQUARE) + w * nz)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _clear(rays: F32, nearest: F32, sums: F32) -> None:
    """Let what is outside the lens hide at once, the rest not at all."""
    zero = full(_ZERO, SQUARE)
    for k in range(SQUARES):
        rz = load(rays, k * RAY + 2 * SQUARE, SQUARE)
        outside = select(rz == _ZERO, full(np.float32(np.inf), SQUARE), _ZERO)
        store(nearest, k * SQUARE, outside)
        for at in range(k * SUMS, (k + 1) * SUMS, SQUARE):
            store(sums, at, zero)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _resolve(sums: F32, rays: F32, left: int, top: int, surface: GeometryPlanes) -> int:
    """Divide the sums of a tile in place and write its whole squares in the picture.

    Returns the number of pixels in the lens that nothing covers.
    """
    depth, normal, coverage = surface
    height, width = depth.shape
    empty = 0
    for k in range(SQUARES):
        at = k * SUMS
        w = load(sums, at, SQUARE)
        t = load(sums, at + SQUARE, SQUARE)
        nx = load(sums, at + 2 * SQUARE, SQUARE)
        ny = load(sums, at + 3 * SQUARE, SQUARE)
        nz = load(sums, at + 4 * SQUARE, SQUARE)
        length = sqrt(nx * nx + ny * ny + nz * nz)
        met = (w > _ZERO) & (length > _ZERO)
        r = select(met, _ONE / length, _ZERO)
        c = select(met, full(_ONE, SQUARE), _ZERO)
        t = select(met, t / w, np.float32(np.inf))
        nx *= r
        ny *= r
        nz *= r
        rz = load(rays, k * RAY + 2 * SQUARE, SQUARE)
        empty += count(~met & (rz != _ZERO))
        x = left + k % SQUARES_X * SIDE
        y = top + k // SQUARES_X * SIDE
        if x + SIDE <= width and y + SIDE <= height:
            place = y * width + x
            store_groups(coverage, place, width, c)
            store_groups(depth, place, width, t)
            store_triples(normal, 3 * place, 3 * width, nx, ny, nz)
        else:
            store(sums, at, c)
            store(sums, at + SQUARE, t)
            store(sums, at + 2 * SQUARE, nx)
            store(sums, at + 3 * SQUARE, ny)
            store(sums, at + 4 * SQUARE, nz)
    return empty


@njit(cache=True, nogil=True, error_model="numpy")
def draw_tile(
    discs: Discs, n: int, rays: F32, left: int, top: int, scratch: SurfelScratch,
    surface: GeometryPlanes,
) -> tuple[int, int, int]:  # fmt: skip
    """Draw one tile's surfels, near ones first, and write its part of the G-buffer.

    The first n items of the scratch memory say which; they are written over. rays:
    ``(SQUARES * RAY,)``, this tile's. Surfels behind the farthest depth of their blocks
    are left out: they could change nothing. Returns (fragments, surfels left out,
    pixels left empty).
    """
    records, boxes, split, inverses, core, behind, refresh = discs
    items, until, squares, nearest, sums, far, starts, ends = scratch
    _clear(rays, nearest, sums)
    far[:] = 0
    fragments = 0
    hidden = 0
    kept = 0
    at = 0
    most = squares.shape[0] - SPARE_SQUARES
    rest = n
    for m in range(n):
        s = items[m]
        o = s * RECORD
        if m % refresh == refresh - 1:
            _refresh(nearest, far)
        if is_hidden(far, boxes, s, left, top, records[o + 14] - behind):
            hidden += 1
            continue
        end = list_squares(records, o, boxes, s, left, top, starts, ends, squares, at)
        _hide(
            records, o, inverses[int(s >= split)], core, rays, nearest, squares, at, end
        )
        fragments += end - at
        if rest < n:
            continue
        if end > most:
            # the squares of this one and all that follow are found again below
            rest = m
            continue
        items[kept] = s
        until[kept] = end
        kept += 1
        at = end
    _refresh(nearest, far)
    for k in range(SQUARES):
        q = load(nearest, k * SQUARE, SQUARE)
        # a pixel without any core is a hole, not a view of whatever is left
        limit = select(q > _ZERO, _ONE / q + behind, _ZERO)
        store(nearest, k * SQUARE, limit)
    at = 0
    for m in range(kept):
        end = until[m]
        s = items[m]
        _add(
            records, s * RECORD, inverses[int(s >= split)], rays, nearest, sums,
            squares, at, end,
        )  # fmt: skip
        at = end
    for m in range(rest, n):
        s = items[m]
        o = s * RECORD
        if is_hidden(far, boxes, s, left, top, records[o + 14] - behind):
            continue
        end = list_squares(records, o, boxes, s, left, top, starts, ends, squares, 0)
        _add(
            records, o, inverses[int(s >= split)], rays, nearest, sums, squares, 0, end
        )
    empty = _resolve(sums, rays, left, top, surface)
    height, width = surface.depth.shape
    if width % SIDE or height % SIDE:
        _write_cut_squares(sums, left, top, surface)
    return fragments * SQUARE, hidden, empty


@njit(cache=True, nogil=True, error_model="numpy")
def draw_tiles(
    counter: I64, across: int, discs: Discs, ranges: I32, listed: int, rays: F32,
    scratch: SurfelScratch, surface: GeometryPlanes, found: I64,
) -> None:  # fmt: skip
    """Draw the tiles that this thread takes from an atomic counter.

    counter: shared by all threads. ranges: tiles of the `listed` surfels. rays:
    ``(tiles, SQUARES * RAY)``. found: ``(tiles, 3)``, what `draw_tile` returns.
    """
    while True:
        tile = fetch_add(counter)
        if tile >= rays.shape[0]:
            return
        row, column = tile // across, tile % across
        n = list_tile(ranges, listed, column, row, scratch.items)
        found[tile, 0], found[tile, 1], found[tile, 2] = draw_tile(
            discs, n, rays[tile], column * TILE_WIDTH, row * TILE_HEIGHT, scratch,
            surface,
        )  # fmt: skip
