"""Surfels into a G-buffer, tile by tile.

A surfel is the tangent disc ``|p - c| < r`` of the plane ``n.(p - c) = 0``. On the ray
with unit direction w the plane lies at depth ``t = 1 / q``, ``q = w . n / (n.c)``,
linear in w, so depth is exact on planes. What a tile needs stands in one scratch
buffer of rows of nine planes: ray x, y, z; q of the nearest core (then the depth
limit); and the sums of w, w t, w nx, w ny, w nz. The plane stride is a constant, so
the compiler sees that the planes do not overlap and makes vector loops of the inner
ones.
"""

import math
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.fsr.projection.kernels import NEAR_VARIANCE

Real = float | np.float32
F32 = NDArray[np.float32]
I32 = NDArray[np.int32]

TILE_WIDTH = 256
TILE_HEIGHT = 32
BLOCK = 16
"""Side of the square blocks whose farthest depth turns hidden surfels down."""

_W = TILE_WIDTH
_PLANES = 9
TILE_FLOATS = _W * _PLANES * TILE_HEIGHT
_BLOCKS_X = TILE_WIDTH // BLOCK
_BLOCKS_Y = TILE_HEIGHT // BLOCK

SMALL = np.float32(24)
BIAS = 1 << 14
"""Added before truncation, so that it rounds down left of the picture too."""


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _rows(record: F32, box: I32, share: Real, top: int, rows: int) -> tuple[int, int]:
    """Give the rows of the tile that a share of the ellipse meets, end excluded."""
    high = math.sqrt(share / record[11])
    y0 = max(box[2], math.floor(record[10] - high - np.float32(0.5)), top)
    y1 = min(box[3], math.ceil(record[10] + high - np.float32(0.5)))
    return y0, min(y1, top + rows - 1) + 1


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _half_width(record: F32, share: Real) -> Any:
    """Take one width for all rows of a small ellipse.

    A constant run is predicted by the processor; its corners cost less than the
    square roots and the mispredicted loop ends of exact rows up to about 24 pixels.
    """
    half = math.sqrt(record[13] * share)
    if half < SMALL or record[11] < NEAR_VARIANCE:
        return half
    return np.float32(-1)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _span(record: F32, share: Real, wide: Real, y: int, left: int) -> tuple[int, int]:
    """Give the first column and the run, a multiple of 8, of one row in the tile.

    wide: half width of every row; a negative one asks for the ellipse's own.
    """
    dy = np.float32(y) + np.float32(0.5) - record[10]
    half = wide
    if half < 0:
        half = math.sqrt(
            max(record[13] * (share - dy * dy * record[11]), np.float32(0))
        )
    run = (int(np.float32(2) * half) + 9) & ~7
    first = int(record[9] + record[12] * dy - half + np.float32(BIAS)) - BIAS - left
    return max(min(first, _W - run), 0), min(run, _W)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _refresh(bits: I32, far: I32) -> None:
    """Take the least q of every block: Reals >= 0 order as their bits do."""
    for by in range(_BLOCKS_Y):
        for bx in range(_BLOCKS_X):
            least = np.int32(0x7F800000)
            for y in range(by * BLOCK, (by + 1) * BLOCK):
                base = (y * _PLANES + 3) * _W + bx * BLOCK
                row = bits[base : base + BLOCK]
                for i in range(BLOCK):
                    least = min(least, row[i])
            far[by * _BLOCKS_X + bx] = least


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _least(bits_far: I32, box: I32, left: int, top: int) -> Any:
    """Find the least q (as bits) of the blocks that a box touches."""
    least = np.int32(0x7F800000)
    a0 = max(box[0] - left, 0) // BLOCK
    a1 = min(box[1] - left, _W - 1) // BLOCK
    for by in range(max(box[2] - top, 0) // BLOCK,
                    min(box[3] - top, TILE_HEIGHT - 1) // BLOCK + 1):  # fmt: skip
        for bx in range(a0, a1 + 1):
            least = min(least, bits_far[by * _BLOCKS_X + bx])
    return least


@njit(cache=True, nogil=True, error_model="numpy")
def draw_tile(
    records: F32, boxes: I32, items: I32, rays: F32, left: int, top: int, core: Real,
    behind: Real, refresh: int, buffer: F32, far: F32, depth: F32, normal: F32,
    coverage: F32,
) -> tuple[int, int]:  # fmt: skip
    """Draw one tile's surfels, near ones first, and write its part of the G-buffer.

    core: squared share of the radius that hides what lies behind. behind: depth in
    mm behind the nearest core that still counts. far: one value a block
    and one to spare. Surfels
    behind the farthest depth of their blocks are left out: they could change nothing.
    Returns (fragments, surfels left out).
    """
    height, width = depth.shape
    columns = min(_W, width - left)
    rows = min(TILE_HEIGHT, height - top)
    bits = buffer.view(np.int32)
    far_bits = far.view(np.int32)
    inf = np.float32(np.inf)
    for y in range(TILE_HEIGHT):
        base = y * _PLANES * _W
        row = buffer[base : base + 9 * _W]
        if y >= rows or columns < _W:
            row[: 3 * _W] = 0
            row[3 * _W : 4 * _W] = inf
        row[4 * _W :] = 0
        if y < rows:
            for c in range(3):
                source = rays[top + y, c, left : left + columns]
                for x in range(columns):
                    row[x + c * _W] = source[x]
            # what is outside the lens hides at once, the rest not at all
            for x in range(columns):
                row[x + 3 * _W] = inf if row[x + 2 * _W] == 0 else np.float32(0)
    far[:] = 0
    fragments = 0
    hidden = 0
    for n in range(items.shape[0]):
        s = items[n]
        record = records[s]
        if n % refresh == refresh - 1:
            _refresh(bits, far_bits)
        box = boxes[s]
        far_bits[_BLOCKS_X * _BLOCKS_Y] = _least(far_bits, box, left, top)
        if far[_BLOCKS_X * _BLOCKS_Y] * record[14] >= 1:
            hidden += 1
            continue
        cx, cy, cz = record[0], record[1], record[2]
        mx, my, mz = record[3], record[4], record[5]
        limit = record[15] * core
        share = core if record[11] > NEAR_VARIANCE else np.float32(1)
        wide = _half_width(record, share)
        y0, y1 = _rows(record, box, share, top, rows)
        for y in range(y0, y1):
            a, run = _span(record, share, wide, y, left)
            fragments += run
            base = (y - top) * _PLANES * _W + a
            row = buffer[base : base + 4 * _W]
            for i in range(run):
                rx = row[i]
                ry = row[i + _W]
                rz = row[i + 2 * _W]
                q = mx * rx + my * ry + mz * rz
                t = np.float32(1) / q
                fx = t * rx - cx
                fy = t * ry - cy
                fz = t * rz - cz
                r2 = fx * fx + fy * fy + fz * fz
                old = row[i + 3 * _W]
                row[i + 3 * _W] = q if (r2 < limit) & (q > old) else old
    _refresh(bits, far_bits)
    for y in range(rows):
        base = (y * _PLANES + 3) * _W
        for x in range(columns):
            q = buffer[base + x]
            # a pixel without any core is a hole, not a view of whatever is left
            buffer[base + x] = np.float32(1) / q + behind if q > 0 else np.float32(0)
    for n in range(items.shape[0]):
        s = items[n]
        record = records[s]
        box = boxes[s]
        far_bits[_BLOCKS_X * _BLOCKS_Y] = _least(far_bits, box, left, top)
        if far[_BLOCKS_X * _BLOCKS_Y] * (record[14] - behind) >= 1:
            continue
        cx, cy, cz = record[0], record[1], record[2]
        mx, my, mz = record[3], record[4], record[5]
        wx, wy, wz = record[6], record[7], record[8]
        inverse = np.float32(1) / record[15]
        share = np.float32(1)
        wide = _half_width(record, share)
        y0, y1 = _rows(record, box, share, top, rows)
        for y in range(y0, y1):
            a, run = _span(record, share, wide, y, left)
            fragments += run
            base = (y - top) * _PLANES * _W + a
            row = buffer[base : base + 9 * _W]
            for i in range(run):
                rx = row[i]
                ry = row[i + _W]
                rz = row[i + 2 * _W]
                t = np.float32(1) / (mx * rx + my * ry + mz * rz)
                fx = t * rx - cx
                fy = t * ry - cy
                fz = t * rz - cz
                f = np.float32(1) - (fx * fx + fy * fy + fz * fz) * inverse
                ok = (f > 0) & (t > 0) & (t < row[i + 3 * _W])
                w = f * f if ok else np.float32(0)
                t = t if ok else np.float32(0)
                row[i + 4 * _W] += w
                row[i + 5 * _W] += w * t
                row[i + 6 * _W] += w * wx
                row[i + 7 * _W] += w * wy
                row[i + 8 * _W] += w * wz
    for y in range(rows):
        base = y * _PLANES * _W
        for x in range(columns):
            w = buffer[base + 4 * _W + x]
            nx = buffer[base + 6 * _W + x]
            ny = buffer[base + 7 * _W + x]
            nz = buffer[base + 8 * _W + x]
            length = math.sqrt(nx * nx + ny * ny + nz * nz)
            if w > 0 and length > 0:
                depth[top + y, left + x] = buffer[base + 5 * _W + x] / w
                normal[top + y, left + x, 0] = nx / length
                normal[top + y, left + x, 1] = ny / length
                normal[top + y, left + x, 2] = nz / length
                coverage[top + y, left + x] = 1
            else:
                depth[top + y, left + x] = inf
                normal[top + y, left + x, 0] = 0
                normal[top + y, left + x, 1] = 0
                normal[top + y, left + x, 2] = 0
                coverage[top + y, left + x] = 0
    return fragments, hidden


@njit(cache=True, nogil=True, error_model="numpy")
def fill_holes(
    rays: F32, depth: F32, normal: F32, coverage: F32, enough: int, where: I32,
    found: F32,
) -> int:  # fmt: skip
    """Give empty pixels the mean of their neighbours where `enough` of 8 have any.

    where, found: room for `(m, 2)` positions and `(m, 4)` values. All means are taken
    before any is written, so the order of the pixels does not matter. Returns the
    number filled.
    """
    height, width = depth.shape
    n = 0
    for y in range(1, height - 1):
        for x in range(1, width - 1):
            if coverage[y, x] > 0 or rays[y, 2, x] == 0 or n == where.shape[0]:
                continue
            count = 0
            t = 0.0
            nx = 0.0
            ny = 0.0
            nz = 0.0
            for b in range(y - 1, y + 2):
                for a in range(x - 1, x + 2):
                    if coverage[b, a] > 0:
                        count += 1
                        t += depth[b, a]
                        nx += normal[b, a, 0]
                        ny += normal[b, a, 1]
                        nz += normal[b, a, 2]
            length = math.sqrt(nx * nx + ny * ny + nz * nz)
            if count >= enough and length > 0:
                where[n, 0] = y
                where[n, 1] = x
                found[n, 0] = t / count
                found[n, 1] = nx / length
                found[n, 2] = ny / length
                found[n, 3] = nz / length
                n += 1
    for m in range(n):
        y = where[m, 0]
        x = where[m, 1]
        depth[y, x] = found[m, 0]
        for c in range(3):
            normal[y, x, c] = found[m, c + 1]
        coverage[y, x] = 1
    return n
