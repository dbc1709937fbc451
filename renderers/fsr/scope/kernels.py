"""Surfels into a G-buffer, tile by tile.

A surfel is the tangent disc ``|p - c| < r`` of the plane ``n.(p - c) = 0``. On the ray
with unit direction w the plane lies at depth ``t = 1 / q``, ``q = w . n / (n.c)``,
linear in w, so depth is exact on planes. What a tile needs stands in one scratch
buffer of strips of four rows; a strip has nine planes: ray x, y, z; q of the nearest
core (then the depth limit); and the sums of w, w t, w nx, w ny, w nz. A plane holds its
4 x 4 squares of pixels one after the other. Its length is a constant, so the compiler
sees that planes do not overlap and makes vector loops of the inner ones.
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

TILE_SHIFT_X = 8
TILE_SHIFT_Y = 5
TILE_WIDTH = 1 << TILE_SHIFT_X
TILE_HEIGHT = 1 << TILE_SHIFT_Y
STRIP = 4
"""Rows of a strip: a disc 12 pixels wide takes four runs of 48 floats instead of
fourteen of 16, and starting a run costs as much as 16 floats."""

BLOCK = 16
"""Side of the square blocks whose farthest depth turns hidden surfels down."""

STRIPS = TILE_HEIGHT // STRIP
PLANE = TILE_WIDTH * STRIP
_PLANES = 9
TILE_FLOATS = STRIPS * _PLANES * PLANE
_BLOCKS_X = TILE_WIDTH // BLOCK
_BLOCKS_Y = TILE_HEIGHT // BLOCK

SMALL = np.float32(16)
"""Half width in pixels up to which all strips of a disc are taken equally wide."""


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _strips(record: F32, box: I32, share: Real, top: int) -> tuple[int, int]:
    """Give the strips of the tile that a share of the ellipse meets, end excluded."""
    high = math.sqrt(share / record[11])
    y0 = max(box[2], math.floor(record[10] - high - np.float32(0.5))) - top
    y1 = min(box[3], math.ceil(record[10] + high - np.float32(0.5))) - top
    return max(y0, 0) // STRIP, min(y1, TILE_HEIGHT - 1) // STRIP + 1


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _half_width(record: F32, share: Real) -> Any:
    """Take one half width for all strips of a small ellipse, -1 for a large one."""
    half = math.sqrt(record[13] * share)
    if half < SMALL or record[11] < NEAR_VARIANCE:
        return half
    return np.float32(-1)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _span(record: F32, share: Real, wide: Real, y: int, left: int) -> tuple[int, int]:
    """Give the first float and the run, in whole 4 x 4 squares, of one strip.

    wide: half width of every row; a negative one asks for the ellipse's own.
    """
    # the strip's pixel centres lie within 1.5 of its middle
    dy = np.float32(y) + np.float32(0.5 * STRIP) - record[10]
    half = wide
    if half < 0:
        d = max(abs(dy) - np.float32(1.5), np.float32(0))
        half = math.sqrt(max(record[13] * (share - d * d * record[11]), np.float32(0)))
    half += np.float32(1.5) * abs(record[12])
    middle = record[9] + record[12] * dy - np.float32(left)
    first = max(middle - half, np.float32(0))
    last = min(middle + half, np.float32(TILE_WIDTH - 1))
    if not first <= last:
        return 0, 0
    a = int(first) >> 2
    return a * 16, ((int(last) >> 2) - a + 1) * 16


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _refresh(bits: I32, far: I32) -> None:
    """Take the least q of every block: floats >= 0 order as their bits do."""
    for by in range(_BLOCKS_Y):
        for bx in range(_BLOCKS_X):
            least = np.int32(0x7F800000)
            for strip in range(by * BLOCK // STRIP, (by + 1) * BLOCK // STRIP):
                base = (strip * _PLANES + 3) * PLANE + bx * BLOCK * STRIP
                row = bits[base : base + BLOCK * STRIP]
                for i in range(BLOCK * STRIP):
                    least = min(least, row[i])
            far[by * _BLOCKS_X + bx] = least


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _least(bits_far: I32, box: I32, left: int, top: int) -> Any:
    """Find the least q (as bits) of the blocks that a box touches."""
    least = np.int32(0x7F800000)
    a0 = max(box[0] - left, 0) // BLOCK
    a1 = min(box[1] - left, TILE_WIDTH - 1) // BLOCK
    for by in range(max(box[2] - top, 0) // BLOCK,
                    min(box[3] - top, TILE_HEIGHT - 1) // BLOCK + 1):  # fmt: skip
        for bx in range(a0, a1 + 1):
            least = min(least, bits_far[by * _BLOCKS_X + bx])
    return least


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _hide(row: F32, run: int, record: F32, core: Real) -> None:
    """Keep the nearest q under a piece of a core."""
    cx, cy, cz = record[0], record[1], record[2]
    mx, my, mz = record[3], record[4], record[5]
    limit = record[15] * core
    for i in range(run):
        rx = row[i]
        ry = row[i + PLANE]
        rz = row[i + 2 * PLANE]
        q = mx * rx + my * ry + mz * rz
        t = np.float32(1) / q
        fx = t * rx - cx
        fy = t * ry - cy
        fz = t * rz - cz
        r2 = fx * fx + fy * fy + fz * fz
        old = row[i + 3 * PLANE]
        row[i + 3 * PLANE] = q if (r2 < limit) & (q > old) else old


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _add(row: F32, run: int, record: F32) -> None:
    """Sum weight, depth and normal under a piece of a disc, up to the depth limit."""
    cx, cy, cz = record[0], record[1], record[2]
    mx, my, mz = record[3], record[4], record[5]
    nx, ny, nz = record[6], record[7], record[8]
    inverse = np.float32(1) / record[15]
    for i in range(run):
        rx = row[i]
        ry = row[i + PLANE]
        rz = row[i + 2 * PLANE]
        t = np.float32(1) / (mx * rx + my * ry + mz * rz)
        fx = t * rx - cx
        fy = t * ry - cy
        fz = t * rz - cz
        f = np.float32(1) - (fx * fx + fy * fy + fz * fz) * inverse
        ok = (f > 0) & (t > 0) & (t < row[i + 3 * PLANE])
        w = f * f if ok else np.float32(0)
        t = t if ok else np.float32(0)
        row[i + 4 * PLANE] += w
        row[i + 5 * PLANE] += w * t
        row[i + 6 * PLANE] += w * nx
        row[i + 7 * PLANE] += w * ny
        row[i + 8 * PLANE] += w * nz


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _resolve(
    row: F32, y: int, left: int, depth: F32, normal: F32, coverage: F32
) -> None:
    """Divide a strip's sums and write them in the picture's order."""
    for i in range(PLANE):
        w = row[i + 4 * PLANE]
        nx = row[i + 6 * PLANE]
        ny = row[i + 7 * PLANE]
        nz = row[i + 8 * PLANE]
        length = math.sqrt(nx * nx + ny * ny + nz * nz)
        met = (w > 0) & (length > 0)
        r = np.float32(1) / length if met else np.float32(0)
        row[i + 4 * PLANE] = np.float32(1) if met else np.float32(0)
        row[i + 5 * PLANE] = row[i + 5 * PLANE] / w if met else np.float32(np.inf)
        row[i + 6 * PLANE] = nx * r
        row[i + 7 * PLANE] = ny * r
        row[i + 8 * PLANE] = nz * r
    for b in range(min(STRIP, depth.shape[0] - y)):
        for a in range(min(TILE_WIDTH, depth.shape[1] - left)):
            i = (a >> 2) * 16 + b * 4 + (a & 3)
            coverage[y + b, left + a] = row[i + 4 * PLANE]
            depth[y + b, left + a] = row[i + 5 * PLANE]
            normal[y + b, left + a, 0] = row[i + 6 * PLANE]
            normal[y + b, left + a, 1] = row[i + 7 * PLANE]
            normal[y + b, left + a, 2] = row[i + 8 * PLANE]


@njit(cache=True, nogil=True, error_model="numpy")
def draw_tile(
    records: F32, boxes: I32, items: I32, rays: F32, left: int, top: int, core: Real,
    behind: Real, refresh: int, buffer: F32, far: F32, depth: F32, normal: F32,
    coverage: F32,
) -> tuple[int, int]:  # fmt: skip
    """Draw one tile's surfels, near ones first, and write its part of the G-buffer.

    rays: ``(strips, 3 * PLANE)``, this tile's, square by square.
    core: squared share of the radius that hides what lies behind. behind: depth in
    mm behind the nearest core that still counts. far: one value a block and one to
    spare. Surfels behind the farthest depth of their blocks are left out: they could
    change nothing. Returns (fragments, surfels left out).
    """
    bits = buffer.view(np.int32)
    far_bits = far.view(np.int32)
    spare = _BLOCKS_X * _BLOCKS_Y
    for strip in range(STRIPS):
        row = buffer[strip * _PLANES * PLANE : (strip + 1) * _PLANES * PLANE]
        row[: 3 * PLANE] = rays[strip]
        row[4 * PLANE :] = 0
        # what is outside the lens hides at once, the rest not at all
        for i in range(PLANE):
            rz = row[i + 2 * PLANE]
            row[i + 3 * PLANE] = np.float32(np.inf) if rz == 0 else np.float32(0)
    far[:] = 0
    fragments = 0
    hidden = 0
    for n in range(items.shape[0]):
        s = items[n]
        record = records[s]
        if n % refresh == refresh - 1:
            _refresh(bits, far_bits)
        far_bits[spare] = _least(far_bits, boxes[s], left, top)
        if far[spare] * record[14] >= 1:
            hidden += 1
            continue
        # the core of a disc too near to be an ellipse may be anywhere in its box
        share = core if record[11] > NEAR_VARIANCE else np.float32(1)
        wide = _half_width(record, share)
        first, end = _strips(record, boxes[s], share, top)
        for strip in range(first, end):
            a, run = _span(record, share, wide, top + STRIP * strip, left)
            fragments += run
            base = strip * _PLANES * PLANE
            _hide(buffer[base + a : base + _PLANES * PLANE], run, record, core)
    _refresh(bits, far_bits)
    for strip in range(STRIPS):
        row = buffer[strip * _PLANES * PLANE : (strip + 1) * _PLANES * PLANE]
        for i in range(PLANE):
            q = row[i + 3 * PLANE]
            # a pixel without any core is a hole, not a view of whatever is left
            limit = np.float32(1) / q + behind
            row[i + 3 * PLANE] = limit if q > 0 else np.float32(0)
    for n in range(items.shape[0]):
        s = items[n]
        record = records[s]
        far_bits[spare] = _least(far_bits, boxes[s], left, top)
        if far[spare] * (record[14] - behind) >= 1:
            continue
        share = np.float32(1)
        wide = _half_width(record, share)
        first, end = _strips(record, boxes[s], share, top)
        for strip in range(first, end):
            a, run = _span(record, share, wide, top + STRIP * strip, left)
            fragments += run
            base = strip * _PLANES * PLANE
            _add(buffer[base + a : base + _PLANES * PLANE], run, record)
    for strip in range(STRIPS):
        row = buffer[strip * _PLANES * PLANE : (strip + 1) * _PLANES * PLANE]
        if top + strip * STRIP < depth.shape[0]:
            _resolve(row, top + strip * STRIP, left, depth, normal, coverage)
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
            if coverage[y, x] > 0 or rays[y, x, 2] == 0 or n == where.shape[0]:
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
