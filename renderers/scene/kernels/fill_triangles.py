"""Triangles met by eight rays at a time, exactly along a lens's rays."""

import numpy as np
from numba import njit

from renderers.scene.kernels.triangles import NEAREST_MM, row_span, slope
from renderers.simd import any_, f32, f64, full, lanes, load_where, store_where, unzip3
from renderers.simd.arrays import Doubles, Floats, Ints, Lanes

W = 8


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _quotient(
    u: Lanes, v: Lanes, w: Lanes, total: Lanes, places: Doubles, r: int
) -> Lanes:
    """Return depths along parallel rays."""
    return (u * places[r, 9] + v * places[r, 10] + w * places[r, 11]) / total


@njit(cache=True, nogil=True, error_model="numpy")
def fill_facets(
    places: Doubles, boxes: Ints, count: int, flat: bool, lens: Floats, depth: Floats,
    owner: Ints, begin: int, end: int,
) -> tuple[int, int]:  # fmt: skip
    """Lower `depth` to the nearest of the listed triangles' and note whose it is.

    Does so in rows ``begin..end`` only, and beyond `NEAREST_MM` of an eye. Returns the
    first column that it looked at and the one past the last.

    places: ``(n, 20)``, see `edge_products`; three corners in pixels; how far the sides
    bulge out from between them, or BOXED. boxes: ``(n, 5)``, which triangle, first
    and last column and row. owner: triangle that gave the depth; left alone elsewhere.
    """
    width = depth.shape[1]
    here = lanes(W)
    from_ = np.float32(0 if flat else NEAREST_MM)
    least, most = width, 0
    for r in range(count):
        top, bottom = max(boxes[r, 3], begin), min(boxes[r, 4] + 1, end)
        if top >= bottom:
            continue
        ax, ay, az = places[r, 0], places[r, 1], places[r, 2]
        bx, by, bz = places[r, 3], places[r, 4], places[r, 5]
        cx, cy, cz = places[r, 6], places[r, 7], places[r, 8]
        d0 = places[r, 9]
        px, py, qx, qy = places[r, 12], places[r, 13], places[r, 14], places[r, 15]
        rx, ry, margin = places[r, 16], places[r, 17], places[r, 18]
        picture = px, py, qx, qy, rx, ry
        slopes = slope(px, py, qx, qy), slope(qx, qy, rx, ry), slope(rx, ry, px, py)
        left, right = boxes[r, 1], boxes[r, 2]
        least, most = min(least, left), max(most, right + 1)
        mine = full(boxes[r, 0], W)
        for y in range(top, bottom):
            first, last = row_span(picture, slopes, margin, y, left, right)
            for x in range(first, last + 1, W):
                at = y * width + x
                more = min(last + 1 - x, W)
                # the three parts of a run of triples, none beyond its end
                a, b, c = unzip3(
                    load_where(lens, 3 * at, here < np.int32(3 * more)),
                    load_where(lens, 3 * at + W, here < np.int32(3 * more - W)),
                    load_where(lens, 3 * at + 2 * W, here < np.int32(3 * more - 2 * W)),
                )
                dx, dy, dz = f64(a), f64(b), f64(c)
                u = dx * ax + dy * ay + dz * az
                v = dx * bx + dy * by + dz * bz
                w = dx * cx + dy * cy + dz * cz
                total = u + v + w
                inside = (u >= 0.0) & (v >= 0.0) & (w >= 0.0)
                inside |= (u <= 0.0) & (v <= 0.0) & (w <= 0.0)
                wanted = here < np.int32(more)
                inside &= (total != 0.0) & wanted
                if not any_(inside):
                    continue
                if flat:
                    t = f32(_quotient(u, v, w, total, places, r))
                else:
                    t = f32(d0 / total)
                near = load_where(depth, at, wanted)
                nearer = inside & (t > from_) & (t < near)
                store_where(depth, at, t, nearer)
                store_where(owner, at, mine, nearer)
    return least, most
