"""Compiled: triangles into a G-buffer, exactly along a lens's rays.

With the eye at the origin and corners a, b, c, a ray d meets the triangle where
``d.(b x c)``, ``d.(c x a)`` and ``d.(a x b)`` have one sign (their shares of the sum
are the barycentric coordinates), at depth ``a.(b x c) / sum``. Nothing in that asks
for a plane of projection, so it holds for every lens. Neighbours share an edge's
product up to its sign: no ray slips between them. Parallel rays are the same sums in
the plane, with corners (x, y, 1). The sums are double: in single precision a triangle
of 0.5 mm at 10 mm would lie 0.3 um off and its neighbours would disagree.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from renderers.scene.kernels.triangle_bounds import (
    BOXED,
    PERSPECTIVE,
    UNSEEN,
    bound_cap,
    bound_equidistant,
    bound_plane,
)
from renderers.simd.arrays import Doubles, Floats, Ints

ORTHOGRAPHIC = 2
"""The value of `Projection`."""

MARGIN_PX = 0.5
"""For rounding."""

NEAREST_MM = 0.5
"""From an eye, nothing nearer is drawn: a lens that all but touches a tool, or is in
it, would see nothing else."""


class LensBounds(NamedTuple):
    """What of a camera decides where in the picture a triangle may show.

    widest: angle from the axis that the lens sees. pixels_per_unit: picture pixels per
    radian, tangent or mm in the middle. stretches: by which factor a distorted lens
    takes pixels out or in, at least and at most.
    """

    projection: int
    widest: float
    pixels_per_unit: float
    stretches: tuple[float, float]
    width: int
    height: int


class CutMesh(NamedTuple):
    """Triangles, and where to look for them; see `Facets`."""

    corners: Floats
    pieces: Floats
    parent: Ints
    first: Ints


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def place(corners: Floats, n: int, turn: Doubles, shift: Doubles, p: Doubles) -> None:
    """Bring triangle n into the camera's frame."""
    for i in range(3):
        x, y, z = corners[n, 3 * i], corners[n, 3 * i + 1], corners[n, 3 * i + 2]
        for j in range(3):
            p[3 * i + j] = turn[j, 0] * x + turn[j, 1] * y + turn[j, 2] * z + shift[j]


@njit(cache=True, nogil=True, error_model="numpy")
def edge_products(p: Doubles, projection: int, e: Doubles) -> None:
    """Give b x c, c x a, a x b; their sum's multiplier of 1/depth or the corners' z.

    e: twelve values. The last three are det, 0, 0 for rays from an eye and the
    corners' depths for parallel rays.
    """
    for i in range(3):
        b, c = 3 * ((i + 1) % 3), 3 * ((i + 2) % 3)
        bz = p[b + 2] if projection != ORTHOGRAPHIC else 1.0
        cz = p[c + 2] if projection != ORTHOGRAPHIC else 1.0
        e[3 * i] = p[b + 1] * cz - bz * p[c + 1]
        e[3 * i + 1] = bz * p[c] - p[b] * cz
        e[3 * i + 2] = p[b] * p[c + 1] - p[b + 1] * p[c]
    if projection == ORTHOGRAPHIC:
        e[9], e[10], e[11] = p[2], p[5], p[8]
    else:
        x = p[4] * p[8] - p[5] * p[7]
        y = p[5] * p[6] - p[3] * p[8]
        z = p[3] * p[7] - p[4] * p[6]
        e[9] = p[0] * x + p[1] * y + p[2] * z
        e[10] = e[11] = 0.0


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _side(
    ax: float, ay: float, slope: float, from_: float, to: float, y: float,
    margin: float, x0: float, x1: float,
) -> tuple[float, float]:  # fmt: skip
    """Widen x0..x1 by the piece of a side that lies within the margin of row y.

    The side runs from height `from_` to `to` and through (ax, ay).
    """
    low, high = max(y - margin, from_), min(y + margin, to)
    if low <= high:
        p = ax + slope * (low - ay)
        q = ax + slope * (high - ay)
        x0, x1 = min(x0, p, q), max(x1, p, q)
    return x0, x1


@njit(cache=True, nogil=True, error_model="numpy")
def bound_groups(
    spheres: Floats, turn: Doubles, shift: Doubles, lens: LensBounds, rows: Ints
) -> None:
    """Say between which rows of the picture each group of triangles may show.

    rows: ``(g, 2)``, first and past the last; no row is left for a group out of view.
    turn, shift: camera from mesh.
    """
    projection, widest, pixels_per_unit, _, _, height = lens
    for g in range(spheres.shape[0]):
        rows[g, 0], rows[g, 1] = 0, height
        x, y, z = spheres[g, 0], spheres[g, 1], spheres[g, 2]
        a = turn[0, 0] * x + turn[0, 1] * y + turn[0, 2] * z + shift[0]
        b = turn[1, 0] * x + turn[1, 1] * y + turn[1, 2] * z + shift[1]
        c = turn[2, 0] * x + turn[2, 1] * y + turn[2, 2] * z + shift[2]
        away = math.sqrt(a * a + b * b + c * c)
        if projection == ORTHOGRAPHIC or away <= spheres[g, 3]:
            continue
        slip = math.asin(spheres[g, 3] / away)
        sine = math.sqrt(a * a + b * b)
        theta = math.atan2(sine, c)
        if theta - slip > widest:
            rows[g, 1] = 0
        elif projection != PERSPECTIVE:
            up, more = bound_cap(b, sine, theta, slip)
            row = height / 2 - 0.5 - up * pixels_per_unit
            reach = more * pixels_per_unit + MARGIN_PX
            rows[g, 0] = math.floor(min(max(row - reach, 0.0), float(height)))
            rows[g, 1] = math.ceil(min(max(row + reach, -1.0), height - 1.0)) + 1


@njit(cache=True, nogil=True, error_model="numpy")
def list_facets(
    mesh: CutMesh, rows: Ints, turn: Doubles, shift: Doubles, lens: LensBounds,
    front: float, piece: int, places: Doubles, boxes: Ints,
) -> tuple[int, int]:  # fmt: skip
    """List the triangles that may show, from a piece on.

    rows: of each group of pieces, see `bound_groups`. turn, shift: camera from mesh.
    front: sign of the triple product of the corners of a triangle that faces the eye,
    where those that look away are left out; 0 where they may show. places, boxes: what
    `fill_facets` wants of each.
    Returns the piece to go on with, where there was no room for more, and how many
    were listed.
    """
    corners, pieces, parent, first = mesh
    projection, widest, pixels_per_unit, stretches, width, height = lens
    p = np.empty(9, np.float64)
    box = np.empty(4, np.float64)
    at = np.empty(6, np.float64)
    e = np.empty(12, np.float64)
    flat = projection == ORTHOGRAPHIC
    least, most = stretches
    distorted = least != 1 or most != 1
    middle_x, middle_y = width / 2 - 0.5, height / 2 - 0.5
    known = -1
    count = 0
    for g in range(rows.shape[0]):
        if rows[g, 1] <= rows[g, 0]:
            continue
        for m in range(max(first[g], piece), first[g + 1]):
            if count == boxes.shape[0]:
                return m, count
            n = parent[m]
            if n != known:
                place(corners, n, turn, shift, p)
                edge_products(p, projection, e)
                known = n
            if e[9] * front < 0:
                continue
            place(pieces, m, turn, shift, p)
            if projection == PERSPECTIVE or flat:
                bulge = bound_plane(p, projection, box, at)
            else:
                bulge = bound_equidistant(p, widest, box, at)
            if bulge == UNSEEN:
                continue
            if distorted:
                # along its own radius, each point by a factor between the two
                bulge = BOXED
                box[0], box[1] = min(box[0] * least, box[0] * most), max(
                    box[1] * least, box[1] * most
                )  # fmt: skip
                box[2], box[3] = min(box[2] * least, box[2] * most), max(
                    box[3] * least, box[3] * most
                )  # fmt: skip
            # in floats first: an infinite bound is no integer
            x0 = max(middle_x + box[0] * pixels_per_unit - MARGIN_PX, 0.0)
            x1 = min(middle_x + box[1] * pixels_per_unit + MARGIN_PX, width - 1.0)
            y0 = max(middle_y - box[3] * pixels_per_unit - MARGIN_PX, 0.0)
            y1 = min(middle_y - box[2] * pixels_per_unit + MARGIN_PX, height - 1.0)
            if not (x0 <= x1 and y0 <= y1):
                continue
            margin = bulge
            if bulge != BOXED:
                margin = bulge * pixels_per_unit + MARGIN_PX
                for i in range(3):
                    at[2 * i] = middle_x + at[2 * i] * pixels_per_unit
                    at[2 * i + 1] = middle_y - at[2 * i + 1] * pixels_per_unit
            places[count, :12] = e
            places[count, 12:18] = at
            places[count, 18] = margin
            boxes[count, 0] = n
            boxes[count, 1], boxes[count, 2] = math.ceil(x0), math.floor(x1)
            boxes[count, 3], boxes[count, 4] = math.ceil(y0), math.floor(y1)
            count += 1
    return pieces.shape[0], count


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def slope(ax: float, ay: float, bx: float, by: float) -> float:
    """Return a side's columns a row; a level side adds nothing to its neighbours."""
    return (bx - ax) / (by - ay) if by != ay else 0.0


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def row_span(
    corners: tuple[float, float, float, float, float, float],
    slopes: tuple[float, float, float], margin: float, y: int, left: int, right: int,
) -> tuple[int, int]:  # fmt: skip
    """Return the columns of row y near a triangle's picture; all of them if BOXED."""
    if margin < 0:
        return left, right
    px, py, qx, qy, rx, ry = corners
    z = float(y)
    x0, x1 = math.inf, -math.inf
    x0, x1 = _side(px, py, slopes[0], min(py, qy), max(py, qy), z, margin, x0, x1)
    x0, x1 = _side(qx, qy, slopes[1], min(qy, ry), max(qy, ry), z, margin, x0, x1)
    x0, x1 = _side(rx, ry, slopes[2], min(ry, py), max(ry, py), z, margin, x0, x1)
    x0, x1 = max(x0 - margin, float(left)), min(x1 + margin, float(right))
    return (math.ceil(x0), math.floor(x1)) if x0 <= x1 else (1, 0)
