"""Compiled: the light of every other pixel, brought to all of them.

A cell is a square of two by two pixels. Its light is that of the pixel of a picture of
half the size that covers it, made of the surface that the cell's first pixel shows.
Between cells that show one smooth piece of tissue light is interpolated by a cubic;
where a piece ends, each pixel takes the light of cells that show what it shows.
"""

import numpy as np
from numba import njit

from renderers.shading.kernels.follow_rays import BufferView
from renderers.simd.arrays import Bytes, Floats, f32

REACH = 2
"""Cells to either side that the cubic is made of."""

STEP = f32(0.06)
"""Of the depth, that cells of one smooth piece differ by from the next at most."""

BEND = f32(0.8)
"""Cosine between the normals of such cells, at least."""

LEAST = f32(0.05)
"""A pixel whose neighbours are so unlike it looks further for some that are like it."""

CUBIC = f32(0.8671875), f32(0.2265625), f32(-0.0703125), f32(-0.0234375)
"""Weights a quarter of a cell from the middle of the nearest of four, which comes first
(Catmull and Rom)."""


@njit(cache=True, nogil=True, error_model="numpy")
def find_edges(view: BufferView, edges: Bytes, first: int, last: int) -> None:
    """Mark the cells ``(h / 2, w / 2)`` of rows ``first..last`` where a piece ends.

    They show a tool, or differ from the cell to the right or below. Where nothing is
    seen is a piece of its own.
    """
    depth, normal, coverage, material, _, _ = view
    rows, columns = edges.shape
    for j in range(first, last):
        v = 2 * min(j + 1, rows - 1)
        y = 2 * j
        for i in range(columns):
            u = 2 * min(i + 1, columns - 1)
            x = 2 * i
            kinds = material[y, x] | material[y, x + 1]
            kinds |= material[y + 1, x] | material[y + 1, x + 1]
            a, b, c = coverage[y, x], coverage[y, x + 1], coverage[y + 1, x]
            d = coverage[y + 1, x + 1]
            least, most = min(min(a, b), min(c, d)), max(max(a, b), max(c, d))
            a, b, c, d = depth[y, x], depth[y, u], depth[v, x], depth[y + 1, x + 1]
            low, high = min(min(a, b), min(c, d)), max(max(a, b), max(c, d))
            p, q, r = normal[y, x, 0], normal[y, x, 1], normal[y, x, 2]
            right = p * normal[y, u, 0] + q * normal[y, u, 1] + r * normal[y, u, 2]
            below = p * normal[v, x, 0] + q * normal[v, x, 1] + r * normal[v, x, 2]
            smooth = (kinds == 0) & (high <= low * (f32(1) + STEP))
            smooth &= (min(right, below) >= BEND) & (least >= f32(1))
            edges[j, i] = not (smooth | (most <= f32(0)))


@njit(cache=True, nogil=True, error_model="numpy")
def widen(edges: Bytes, rough: Bytes, first: int, last: int) -> None:
    """Mark the cells of rows ``first..last`` with an edge within `REACH`."""
    rows, columns = edges.shape
    near = np.zeros(columns + 2 * REACH, np.uint8)
    for j in range(first, last):
        near[:] = 0
        for row in range(max(j - REACH, 0), min(j + REACH + 1, rows)):
            for i in range(columns):
                near[REACH + i] |= edges[row, i]
        for i in range(columns):
            found = near[i]
            for k in range(1, 2 * REACH + 1):
                found |= near[i + k]
            rough[j, i] = found


@njit(cache=True, nogil=True, error_model="numpy")
def enlarge(
    light: Floats, rough: Bytes, radiance: Floats, first: int, last: int
) -> None:
    """Write the smooth cells of rows ``first..last`` of cells.

    light: of the cells, ``(h / 2, w / 2, 3)``.
    """
    rows, columns, _ = light.shape
    flat = 3 * columns
    line = np.zeros(flat + 12, np.float32)
    even, odd = np.empty(flat, np.float32), np.empty(flat, np.float32)
    w0, w1, w2, w3 = CUBIC
    for j in range(first, last):
        here = light[j].ravel()
        for down in range(2):
            way = 2 * down - 1
            near = light[min(max(j + way, 0), rows - 1)].ravel()
            far = light[min(max(j - way, 0), rows - 1)].ravel()
            beyond = light[min(max(j + 2 * way, 0), rows - 1)].ravel()
            for k in range(flat):
                mean = w0 * here[k] + w1 * near[k]
                line[6 + k] = mean + w2 * far[k] + w3 * beyond[k]
            for k in range(6):
                # beyond its ends a row goes on as it ends
                line[k], line[6 + flat + k] = line[6 + k % 3], line[3 + flat + k % 3]
            for k in range(flat):
                mean, left, right = w0 * line[k + 6], line[k + 3], line[k + 9]
                even[k] = mean + w1 * left + w2 * right + w3 * line[k]
                odd[k] = mean + w1 * right + w2 * left + w3 * line[k + 12]
            out = radiance[2 * j + down]
            for i in range(columns):
                if not rough[j, i]:
                    for c in range(3):
                        # a cubic may fall below what it joins
                        out[2 * i, c] = max(even[3 * i + c], f32(0))
                        out[2 * i + 1, c] = max(odd[3 * i + c], f32(0))


@njit(cache=True, nogil=True, error_model="numpy")
def take_likest(
    view: BufferView, half: BufferView, light: Floats, rough: Bytes, radiance: Floats,
    first: int, last: int,
) -> None:  # fmt: skip
    """Write the pixels of rough cells of rows ``first..last`` of cells.

    half: what the cells show. light: as for `enlarge`.
    """
    depth, normal, coverage, material, _, _ = view
    cell_depth, cell_normal, cell_coverage, cell_material, _, _ = half
    rows, columns = rough.shape
    for j in range(first, last):
        for i in range(columns):
            if not rough[j, i]:
                continue
            for pixel in range(4):
                down, right = pixel >> 1, pixel & 1
                y, x = 2 * j + down, 2 * i + right
                cover = coverage[y, x]
                red = green = blue = total = f32(0)
                # its own cell and the three next to it, then all within reach
                reach = 1
                while cover > f32(0) and total < LEAST and reach <= REACH:
                    red = green = blue = total = f32(0)
                    top, left = j + down - reach, i + right - reach
                    for a in range(max(top, 0), min(top + 2 * reach, rows)):
                        away = abs(f32(a - j) - f32(0.5) * f32(down) + f32(0.25))
                        for b in range(max(left, 0), min(left + 2 * reach, columns)):
                            if cell_material[a, b] != material[y, x]:
                                continue
                            if cell_coverage[a, b] <= f32(0):
                                continue
                            aside = abs(f32(b - i) - f32(0.5) * f32(right) + f32(0.25))
                            k = (f32(reach) - away) * (f32(reach) - aside)
                            apart = cell_depth[a, b] / depth[y, x] - f32(1)
                            same = normal[y, x, 0] * cell_normal[a, b, 0]
                            same += normal[y, x, 1] * cell_normal[a, b, 1]
                            same += normal[y, x, 2] * cell_normal[a, b, 2]
                            same = max(same, f32(0))
                            same *= same
                            apart = f32(1) + f32(400) * apart * apart
                            k *= same * same / (apart * apart)
                            total += k
                            k /= cell_coverage[a, b]
                            red += k * light[a, b, 0]
                            green += k * light[a, b, 1]
                            blue += k * light[a, b, 2]
                    reach += 1
                if cover > f32(0) and total < f32(1e-6):
                    # nothing is like it, so its own cell's will do
                    total = cover
                    red, green, blue = light[j, i, 0], light[j, i, 1], light[j, i, 2]
                k = cover / max(total, f32(1e-6))
                radiance[y, x, 0] = k * red
                radiance[y, x, 1] = k * green
                radiance[y, x, 2] = k * blue
