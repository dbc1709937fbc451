"""Tissue that gives way to a tool: where what is seen at a place lies at rest.

Two maps take a place x back to its place at rest q(x). A dent moves tissue radially
away from a capsule; a shift carries a ball of it along. Both are continuous and one to
one, so that what is connected stays so: no wall is pierced by them.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from surgery.kernels.distance_field import to_voxel_inside

Floats = NDArray[np.float32]
Doubles = NDArray[np.float64]
Longs = NDArray[np.int64]

CAP_ROWS = 4
"""Rows of a dent's table from the pole of the capsule's tip to its equator."""

SLOPE = 0.8
"""Depth of a dent changes by at most this much per mm along the tool."""

DEEPEST = 0.85
"""Radii of the tool that tissue gives way at most: beyond, the map would tear."""

TORN = 0.05
"""Least share of its distance from the axis that a place in the tool keeps at rest."""

SCALED_MM = 1.0
"""Values are made less for the stretch so near to the surface; farther away that much
of them is."""

_PROBES = 10


class Grid(NamedTuple):
    """Where a field lies.

    world, voxel: ``(3, 4)`` float64, world from voxel and back, (i, j, k) and mm.
    """

    world: Doubles
    voxel: Doubles


class Dent(NamedTuple):
    """Describe where tissue gives way to a capsule.

    frame: ``(4, 3)``: centre of the tip, unit axis towards the back, and two units
    across it. size: ``(5,)`` radius, length of the axis, mm per row, width of what
    moves as a whole, width over which the rest fades; mm. depth: ``(rows, columns)`` mm
    by place on the tool: `CAP_ROWS` from the pole on, then along the shaft.
    """

    frame: Doubles
    size: Doubles
    depth: Doubles


Dents = tuple[Dent, Dent, Dent, Dent]
"""Of the two parts of a tool, and those that spring back from them; the part behind a
bend comes before the tip, through whose dent it was measured."""


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _cell(
    shape: tuple[int, int, int], m: Doubles, x: float, y: float, z: float
) -> tuple[int, int, int, float, float, float]:
    """Return a place's voxel (i, j, k) and how far it is to the next, along each."""
    nz, ny, nx = shape
    u, v, w = to_voxel_inside(shape, m, x, y, z)
    i, j, k = min(int(u), nx - 2), min(int(v), ny - 2), min(int(w), nz - 2)
    return i, j, k, u - i, v - j, w - k


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _within(
    values: Floats, i: int, j: int, k: int, fx: float, fy: float, fz: float
) -> float:
    """Interpolate a field in a cell."""
    a = values[k, j, i] * (1 - fx) + values[k, j, i + 1] * fx
    b = values[k, j + 1, i] * (1 - fx) + values[k, j + 1, i + 1] * fx
    c = values[k + 1, j, i] * (1 - fx) + values[k + 1, j, i + 1] * fx
    d = values[k + 1, j + 1, i] * (1 - fx) + values[k + 1, j + 1, i + 1] * fx
    value: float = (a * (1 - fy) + b * fy) * (1 - fz) + (c * (1 - fy) + d * fy) * fz
    return value


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _read(values: Floats, m: Doubles, x: float, y: float, z: float) -> float:
    """Interpolate a field at a place in the world; beyond the grid its face goes on."""
    i, j, k, fx, fy, fz = _cell(values.shape, m, x, y, z)
    return _within(values, i, j, k, fx, fy, fz)


@njit(cache=True, nogil=True, error_model="numpy")
def unshift(
    shifts: Doubles, x: float, y: float, z: float
) -> tuple[float, float, float, float]:
    """Return where shifts take a place from, and how much they stretch there.

    shifts: ``(n, 7)`` rows of middle, shift and radius, mm, the newest last. What is at
    x comes from ``x - w v`` with ``w = (1 - r^2 / R^2)^2``.
    """
    stretch = 0.0
    for n in range(shifts.shape[0] - 1, -1, -1):
        s = shifts[n]
        dx, dy, dz = x - s[0], y - s[1], z - s[2]
        r2 = (dx * dx + dy * dy + dz * dz) / (s[6] * s[6])
        if r2 >= 1.0:
            continue
        w = (1.0 - r2) * (1.0 - r2)
        x -= w * s[3]
        y -= w * s[4]
        z -= w * s[5]
        size = math.sqrt(s[3] * s[3] + s[4] * s[4] + s[5] * s[5])
        stretch += size * 4.0 * (1.0 - r2) * math.sqrt(r2) / s[6]
    return x, y, z, stretch


@njit(cache=True, nogil=True, error_model="numpy")
def undent(
    frame: Doubles, size: Doubles, depth: Doubles, x: float, y: float, z: float
) -> tuple[float, float, float, float]:
    """Return where a dent takes a place from, and its stretch along the radius."""
    radius, length, step, whole, fading = size[0], size[1], size[2], size[3], size[4]
    rows, columns = depth.shape
    dx, dy, dz = x - frame[0, 0], y - frame[0, 1], z - frame[0, 2]
    t = dx * frame[1, 0] + dy * frame[1, 1] + dz * frame[1, 2]
    along = min(max(t, 0.0), length)
    ox = dx - along * frame[1, 0]
    oy = dy - along * frame[1, 1]
    oz = dz - along * frame[1, 2]
    rho2 = ox * ox + oy * oy + oz * oz
    reach = radius + whole + fading
    if rho2 >= reach * reach or rho2 < 1e-18 or t > length:
        return x, y, z, 0.0
    rho = math.sqrt(rho2)
    p = ox * frame[2, 0] + oy * frame[2, 1] + oz * frame[2, 2]
    q = ox * frame[3, 0] + oy * frame[3, 1] + oz * frame[3, 2]
    row = CAP_ROWS + along / step
    if t < 0.0:
        rise = math.atan2(-t, math.sqrt(p * p + q * q))
        row = CAP_ROWS * (1.0 - rise / (0.5 * math.pi))
    around = math.atan2(q, p) / (2.0 * math.pi)
    if around < 0.0:
        around += 1.0
    column = around * columns
    a = min(int(row), rows - 2)
    b = min(int(column), columns - 1)
    c = (b + 1) % columns
    fa, fb = min(row - a, 1.0), column - b
    deep = (depth[a, b] * (1 - fb) + depth[a, c] * fb) * (1 - fa) + (
        depth[a + 1, b] * (1 - fb) + depth[a + 1, c] * fb
    ) * fa
    if deep <= 0.0:
        return x, y, z, 0.0
    share = 1.0 - max(rho - radius - whole, 0.0) / fading
    # inside the tool, where none of this is seen, all that would lie beyond its axis
    rest = max(rho - deep * share * share, TORN * rho)
    stretch = 2.0 * deep * share / fading if share < 1.0 else 0.0
    back = rest / rho - 1.0
    return x + back * ox, y + back * oy, z + back * oz, stretch


@njit(cache=True, nogil=True, error_model="numpy")
def measure_dent(
    rest: Floats, voxel: Doubles, shifts: Doubles, frame: Doubles, size: Doubles,
    depth: Doubles, other: Dent,
) -> None:  # fmt: skip
    """Fill a dent's table: how deep the tool is in tissue that no dent moves yet.

    But for `other`, of another part of the same tool. Between places on the tool depths
    change by at most `SLOPE`.
    """
    rows, columns = depth.shape
    radius, length, step = size[0], size[1], size[2]
    for row in range(rows):
        rise, along = 0.0, max(row - CAP_ROWS, 0) * step
        if row < CAP_ROWS:
            rise = 0.5 * math.pi * (1.0 - row / CAP_ROWS)
        # the shaft goes on beyond the part that is looked at
        fade = max(min(1.0, (length - along) / (2.0 * step)), 0.0)
        for column in range(columns):
            turn = 2.0 * math.pi * column / columns
            p, q, t = (
                math.cos(rise) * math.cos(turn),
                math.cos(rise) * math.sin(turn),
                -math.sin(rise),
            )
            found = radius
            before = 0.0
            for n in range(_PROBES + 1):
                r = radius * n / _PROBES
                at0 = frame[0, 0] + along * frame[1, 0]
                at1 = frame[0, 1] + along * frame[1, 1]
                at2 = frame[0, 2] + along * frame[1, 2]
                x = at0 + r * (p * frame[2, 0] + q * frame[3, 0] + t * frame[1, 0])
                y = at1 + r * (p * frame[2, 1] + q * frame[3, 1] + t * frame[1, 1])
                z = at2 + r * (p * frame[2, 2] + q * frame[3, 2] + t * frame[1, 2])
                x, y, z, _ = undent(other.frame, other.size, other.depth, x, y, z)
                x, y, z, _ = unshift(shifts, x, y, z)
                d = _read(rest, voxel, x, y, z)
                if d > 0.0:
                    found = r
                    if n > 0 and d > before:
                        found -= radius / _PROBES * d / (d - before)
                    break
                before = d
            need = min(radius - found, DEEPEST * radius)
            depth[row, column] = need * fade
    _limit_slopes(depth, radius, step)


@njit(cache=True, nogil=True, error_model="numpy")
def _limit_slopes(depth: Doubles, radius: float, step: float) -> None:
    """Raise depths until neighbours differ by no more than `SLOPE` allows."""
    rows, columns = depth.shape
    pole = 0.0
    for column in range(columns):
        pole = max(pole, depth[0, column])
    depth[0, :] = pole
    arc = 0.5 * math.pi * radius / CAP_ROWS
    for turn in range(4):
        for n in range(rows):
            row = n if turn % 2 == 0 else rows - 1 - n
            around = radius * 2.0 * math.pi / columns
            if row < CAP_ROWS:
                around *= math.sin(0.5 * math.pi * row / CAP_ROWS)
            for m in range(2 * columns):
                column = (
                    m % columns if turn % 2 == 0 else (2 * columns - 1 - m) % columns
                )
                best = depth[row, column]
                left, right = (column - 1) % columns, (column + 1) % columns
                beside = max(depth[row, left], depth[row, right])
                best = max(best, beside - SLOPE * around)
                if row > 0:
                    gap = arc if row <= CAP_ROWS else step
                    best = max(best, depth[row - 1, column] - SLOPE * gap)
                if row < rows - 1:
                    gap = arc if row < CAP_ROWS else step
                    best = max(best, depth[row + 1, column] - SLOPE * gap)
                depth[row, column] = best


@njit(cache=True, nogil=True, error_model="numpy")
def bring_to_rest(shifts: Doubles, dents: Dents, places: Doubles) -> None:
    """Move places to where they lie at rest, and add up the maps' stretch there.

    places: ``(n, 4)`` x, y, z and stretch. One dent after the other: to take one out of
    several at each place costs more than all the rest.
    """
    for n in range(4):
        frame, size, depth = dents[n].frame, dents[n].size, dents[n].depth
        if size[0] == 0.0:
            continue
        for row in range(places.shape[0]):
            at = places[row]
            x, y, z, stretch = undent(frame, size, depth, at[0], at[1], at[2])
            at[0], at[1], at[2] = x, y, z
            at[3] += stretch
    if shifts.shape[0] == 0:
        return
    for row in range(places.shape[0]):
        at = places[row]
        x, y, z, stretch = unshift(shifts, at[0], at[1], at[2])
        at[0], at[1], at[2] = x, y, z
        at[3] += stretch


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _lessened(value: float, less: float) -> np.float32:
    """Bring a distance nearer to zero by a share of its first `SCALED_MM`."""
    return np.float32(value - less * min(max(value, -SCALED_MM), SCALED_MM))


@njit(cache=True, nogil=True, error_model="numpy")
def bend_box(
    rest: tuple[Floats, Floats], shown: tuple[Floats, Floats], grid: Grid, box: Longs,
    shifts: Doubles, dents: Dents, bounds: Longs,
    offsets: tuple[Floats, Floats, Floats],
) -> int:  # fmt: skip
    """Show a box of two fields as they are bent; return how many voxels changed.

    rest, shown: of the surface as carved and of the pristine one, which bend alike.
    Values are made less by the stretch near the surface, so that a distance is not too
    large there; what was cut is as deep as at rest. box: i0 j0 k0 i1 j1 k1, ends
    excluded. bounds: ``(6,)``, first and last changed voxel. offsets: mm along x, y and
    z from where tissue is shown to where it lies at rest.
    """
    carved, pristine = rest
    off_x, off_y, off_z = offsets
    shown_carved, shown_pristine = shown
    world, voxel = grid
    bounds[:3] = 1 << 30
    bounds[3:] = -1
    count = 0
    first = box[0]
    lying = np.empty((max(box[3] - first, 0), 4))
    for k in range(box[2], box[5]):
        for j in range(box[1], box[4]):
            for i in range(first, box[3]):
                at = lying[i - first]
                for axis in range(3):
                    at[axis] = (
                        world[axis, 0] * i + world[axis, 1] * j + world[axis, 2] * k
                    ) + world[axis, 3]
                at[3] = 0.0
            bring_to_rest(shifts, dents, lying)
            for i in range(first, box[3]):
                x = world[0, 0] * i + world[0, 1] * j + world[0, 2] * k + world[0, 3]
                y = world[1, 0] * i + world[1, 1] * j + world[1, 2] * k + world[1, 3]
                z = world[2, 0] * i + world[2, 1] * j + world[2, 2] * k + world[2, 3]
                at = lying[i - first]
                u, v, w, stretch = at[0], at[1], at[2], at[3]
                if u == x and v == y and w == z:
                    # to the bit: what is not bent is shown as it is
                    a, b = carved[k, j, i], pristine[k, j, i]
                else:
                    less = stretch / (1.0 + stretch)
                    ci, cj, ck, fx, fy, fz = _cell(carved.shape, voxel, u, v, w)
                    now = _within(carved, ci, cj, ck, fx, fy, fz)
                    before = _within(pristine, ci, cj, ck, fx, fy, fz)
                    a = _lessened(now, less)
                    b = np.float32(a + (before - now))
                dx, dy, dz = np.float32(u - x), np.float32(v - y), np.float32(w - z)
                if (
                    a == shown_carved[k, j, i]
                    and b == shown_pristine[k, j, i]
                    and dx == off_x[k, j, i]
                    and dy == off_y[k, j, i]
                    and dz == off_z[k, j, i]
                ):
                    continue
                off_x[k, j, i], off_y[k, j, i], off_z[k, j, i] = dx, dy, dz
                shown_carved[k, j, i] = a
                shown_pristine[k, j, i] = b
                count += 1
                bounds[0], bounds[3] = min(bounds[0], i), max(bounds[3], i)
                bounds[1], bounds[4] = min(bounds[1], j), max(bounds[4], j)
                bounds[2], bounds[5] = min(bounds[2], k), max(bounds[5], k)
    return count


@njit(cache=True, nogil=True, error_model="numpy")
def rest_places(points: Doubles, shifts: Doubles, dents: Dents, out: Doubles) -> None:
    """Find where places ``(n, 3)`` lie at rest."""
    lying = np.zeros((points.shape[0], 4))
    lying[:, :3] = points
    bring_to_rest(shifts, dents, lying)
    out[:] = lying[:, :3]
