"""Cones traced into the walls, and blocks tested against where they end."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

F32 = NDArray[np.float32]
F64 = NDArray[np.float64]
I32 = NDArray[np.int32]
I64 = NDArray[np.int64]
U8 = NDArray[np.uint8]


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _direction(
    u: float, v: float, projection: int, extent: float, width: int, height: int
) -> tuple[float, float, float]:
    """Give the camera-frame unit ray through a pixel position."""
    half = 0.5 * min(width, height)
    x = (u - 0.5 * width) / half
    y = (0.5 * height - v) / half
    if projection == 0:
        r = math.sqrt(x * x + y * y)
        theta = min(r * extent, math.pi)
        k = math.sin(theta) / r if r > 1e-9 else extent
        return k * x, k * y, math.cos(theta)
    x *= math.tan(extent)
    y *= math.tan(extent)
    k = 1.0 / math.sqrt(x * x + y * y + 1.0)
    return k * x, k * y, k


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _distance(values: F32, nx: int, ny: int, x: float, y: float, z: float) -> float:
    """Interpolate the signed distance trilinearly inside the grid."""
    i = int(x)
    j = int(y)
    k = int(z)
    fx = x - i
    fy = y - j
    fz = z - k
    n = (k * ny + j) * nx + i
    m = n + nx * ny
    a = values[n] + fx * (values[n + 1] - values[n])
    b = values[n + nx] + fx * (values[n + nx + 1] - values[n + nx])
    c = values[m] + fx * (values[m + 1] - values[m])
    d = values[m + nx] + fx * (values[m + nx + 1] - values[m + nx])
    low = a + fy * (b - a)
    return float(low + fz * (c + fy * (d - c) - low))


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _enter(
    x: float, y: float, z: float, sx: float, sy: float, sz: float, nx: int, ny: int,
    nz: int,
) -> float:  # fmt: skip
    """Give the depth at which a line is first inside the grid; +inf if it never is."""
    low, high = 0.0, math.inf
    for p, s, n in ((x, sx, nx), (y, sy, ny), (z, sz, nz)):
        if abs(s) > 1e-12:
            a, b = -p / s, (n - 1 - p) / s
            low, high = max(low, min(a, b)), min(high, max(a, b))
        elif p < 0 or p > n - 1:
            low = math.inf
    return low if low <= high else math.inf


@njit(cache=True, nogil=True, error_model="numpy")
def aim_cones(
    projection: int, extent: float, width: int, height: int, side: int, cones: F64
) -> None:
    """Find the cones around squares of `side` pixels; a lens has the same in any view.

    cones: ``(rows, columns, 4)``, the axis in the camera's frame and the cosine of the
    half angle; an axis of zeros where the lens shows nothing.
    """
    for row in range(cones.shape[0]):
        for column in range(cones.shape[1]):
            u0 = column * side
            v0 = row * side
            dx, dy, dz = _direction(
                u0 + 0.5 * side, v0 + 0.5 * side, projection, extent, width, height
            )
            cosine = 1.0
            for corner in range(4):
                cx, cy, cz = _direction(
                    u0 + side * (corner & 1),
                    v0 + side * (corner >> 1),
                    projection,
                    extent,
                    width,
                    height,
                )
                cosine = min(cosine, dx * cx + dy * cy + dz * cz)
            if projection == 0:
                # squares wholly outside the round stop show nothing at any depth
                gap_x = max(abs(u0 + 0.5 * side - 0.5 * width) - 0.5 * side, 0.0)
                gap_y = max(abs(v0 + 0.5 * side - 0.5 * height) - 0.5 * side, 0.0)
                stop = 0.5 * min(width, height) + 4.0
                if gap_x * gap_x + gap_y * gap_y > stop * stop:
                    dx = dy = dz = 0.0
            cones[row, column, 0] = dx
            cones[row, column, 1] = dy
            cones[row, column, 2] = dz
            cones[row, column, 3] = cosine


@njit(cache=True, nogil=True, error_model="numpy")
def trace_cones(
    values: F32, nx: int, ny: int, nz: int, voxel_from_camera: F64, cones: F64,
    margin: float, first: int, end: int, ends: F32,
) -> None:  # fmt: skip
    """Fill, per square of pixels, the depth behind which nothing shows.

    cones: by `aim_cones`. A cone around the square's rays ends where a ball of tissue
    spans it: where the signed distance exceeds the cone's radius by `margin` (mm). The
    distance changes by less than its argument, so stepping by what is missing passes no
    such place.
    A cone from outside the grid begins where it enters; what lies behind tissue there
    is hidden by the face at which the grid cuts through it.
    Rows `first`..`end` - 1 of squares are done; +inf where the cone leaves the grid.
    """
    m = voxel_from_camera
    # voxels per mm along the grid's axes
    ux = math.sqrt(m[0, 0] ** 2 + m[0, 1] ** 2 + m[0, 2] ** 2)
    uy = math.sqrt(m[1, 0] ** 2 + m[1, 1] ** 2 + m[1, 2] ** 2)
    uz = math.sqrt(m[2, 0] ** 2 + m[2, 1] ** 2 + m[2, 2] ** 2)
    for row in range(first, end):
        for column in range(ends.shape[1]):
            dx = cones[row, column, 0]
            dy = cones[row, column, 1]
            dz = cones[row, column, 2]
            cosine = cones[row, column, 3]
            if dx == 0 and dy == 0 and dz == 0:
                ends[row, column] = -1.0
                continue
            slope = math.sqrt(max(1.0 - cosine * cosine, 0.0)) / max(cosine, 0.1)
            sx = m[0, 0] * dx + m[0, 1] * dy + m[0, 2] * dz
            sy = m[1, 0] * dx + m[1, 1] * dy + m[1, 2] * dz
            sz = m[2, 0] * dx + m[2, 1] * dy + m[2, 2] * dz
            ends[row, column] = np.inf
            t = _enter(m[0, 3], m[1, 3], m[2, 3], sx, sy, sz, nx, ny, nz)
            # outside there is air
            begun = t
            in_air = begun > 0
            # a hair further, or rounding would leave it outside
            t += 1e-3 if in_air else 0.0
            for _ in range(512):
                x = m[0, 3] + t * sx
                y = m[1, 3] + t * sy
                z = m[2, 3] + t * sz
                inside = (x >= 0) & (y >= 0) & (z >= 0)
                if not (inside & (x < nx - 1) & (y < ny - 1) & (z < nz - 1)):
                    break
                d = _distance(values, nx, ny, x, y, z)
                # an eye in the tissue looks into the first air that it meets
                in_air = in_air or d < 0
                if not in_air:
                    t += max(d, margin)
                    continue
                missing = t * slope + margin - d
                if missing <= 0 and begun > 0:
                    # what is beyond a side of the grid hides nothing
                    gap = min(x, nx - 1 - x) / ux
                    gap = min(gap, min(y, ny - 1 - y) / uy, min(z, nz - 1 - z) / uz)
                    missing = t * slope - gap
                if missing <= 0:
                    ends[row, column] = t / max(cosine, 0.1)
                    break
                t += max(missing, margin)


@njit(cache=True, nogil=True, error_model="numpy")
def _look_at(
    middles: F64, first: int, m: F64, radius: float, planes: F64, place: F64,
    inside: U8,
) -> None:  # fmt: skip
    """Bring balls to the camera's frame; say which reach inside all planes.

    Simple loops without a way out, which the compiler turns into vectors.
    """
    count = inside.shape[0]
    i = middles[0, first : first + count]
    j = middles[1, first : first + count]
    k = middles[2, first : first + count]
    x, y, z = place[0], place[1], place[2]
    for axis in range(3):
        a, b, c, d = m[axis, 0], m[axis, 1], m[axis, 2], m[axis, 3]
        to = place[axis]
        for n in range(count):
            to[n] = a * i[n] + b * j[n] + c * k[n] + d
    inside[:] = 1
    for p in range(planes.shape[0]):
        a, b, c, d = planes[p, 0], planes[p, 1], planes[p, 2], planes[p, 3]
        for n in range(count):
            inside[n] &= np.uint8(not a * x[n] + b * y[n] + c * z[n] + d < -radius)


@njit(cache=True, nogil=True, error_model="numpy")
def flag_blocks(
    middles: F64, first: int, end: int, camera_from_voxel: F64, radius: float,
    planes: F64, near_reach: float, far_from: float, projection: int, extent: float,
    width: int, height: int, side: int, ends: F32, allowed: U8, shown: U8,
    distances: F32,
) -> tuple[int, int]:  # fmt: skip
    """Mark the blocks that may show: 1 beyond `far_from`, 2 nearer than `near_reach`.

    middles: ``(3, blocks)`` voxels, x, y and z; `first`..`end` - 1 are to be done.
    radius: of the ball around a block with its elements' discs (mm). planes: camera
    frame ``(p, 4)``, positive inside. ends: from `trace_cones`, or empty. allowed: per
    block, 0 for those that are hidden anyway. shown, distances: per block, the mark, 0
    where nothing shows, and the distance of its middle (mm).
    Returns (blocks in view, of them hidden).
    """
    half = 0.5 * min(width, height)
    scale = half / extent if projection == 0 else half / math.tan(extent)
    met = 0
    hidden = 0
    place = np.empty((3, end - first))
    inside = np.empty(end - first, np.uint8)
    _look_at(middles, first, camera_from_voxel, radius, planes, place, inside)
    for n in range(first, end):
        shown[n] = 0
        if not inside[n - first]:
            continue
        met += 1
        if not allowed[n]:
            hidden += 1
            continue
        x, y, z = place[0, n - first], place[1, n - first], place[2, n - first]
        distance = math.sqrt(x * x + y * y + z * z)
        near = distance - radius
        if ends.shape[0]:
            rho = math.sqrt(x * x + y * y)
            theta = math.atan2(rho, z)
            reach = math.asin(radius / distance) if distance > 1.01 * radius else 1.6
            if theta + reach < (2.0 if projection == 0 else 1.4):
                if projection == 0:
                    u = scale * theta
                    spread = scale * reach
                    # a circle of directions widens where the lens does
                    spread *= max((theta + reach) / math.sin(theta + reach), 1.0)
                else:
                    u = scale * math.tan(theta)
                    spread = scale * math.tan(theta + reach) - u
                    spread = max(spread, u - scale * math.tan(theta - reach))
                c = x / rho if rho > 1e-9 else 1.0
                s = y / rho if rho > 1e-9 else 0.0
                px = 0.5 * width + u * c
                py = 0.5 * height - u * s
                a0 = max(math.floor((px - spread) / side), 0)
                a1 = min(math.floor((px + spread) / side), ends.shape[1] - 1)
                b0 = max(math.floor((py - spread) / side), 0)
                b1 = min(math.floor((py + spread) / side), ends.shape[0] - 1)
                blocked = True
                for row in range(b0, b1 + 1):
                    for column in range(a0, a1 + 1):
                        if ends[row, column] >= near:
                            blocked = False
                            break
                    if not blocked:
                        break
                if blocked:
                    hidden += 1
                    continue
        distances[n] = distance
        shown[n] = (1 if distance + radius >= far_from else 0) | (
            2 if near <= near_reach else 0
        )
    return met, hidden


@njit(cache=True, nogil=True, error_model="numpy")
def list_runs(
    shown: U8, mark: int, distances: F32, step: float, offsets: I64, part: int,
    rows: I64, heads: I64, runs: I64, cuts: I64,
) -> tuple[int, int, int]:  # fmt: skip
    """List the elements of all blocks with a mark, near blocks first.

    offsets: where each block's elements begin, and their end. step: distances (mm)
    that differ by less may keep the list's order. rows: how many each block's
    elements are in. heads: scratch, one per step.
    runs: room for ``(blocks, 2)`` first elements and ends. cuts: room for ``(parts +
    1, 2)``: the runs are cut into parts of `part` or a few more elements; each part's
    first run and the number of elements before it. Returns (runs, parts, rows).
    """
    heads[:] = 0
    last = heads.shape[0] - 2
    for n in range(shown.shape[0]):
        if shown[n] & mark and offsets[n + 1] > offsets[n]:
            heads[min(int(distances[n] / step), last) + 1] += 1
    for h in range(last + 1):
        heads[h + 1] += heads[h]
    total = heads[last + 1]
    kept = 0
    for n in range(shown.shape[0]):
        if shown[n] & mark and offsets[n + 1] > offsets[n]:
            h = min(int(distances[n] / step), last)
            runs[heads[h], 0] = offsets[n]
            runs[heads[h], 1] = offsets[n + 1]
            heads[h] += 1
            kept += rows[n]
    parts = 0
    elements = 0
    begun = 0
    for r in range(total):
        if r == 0 or elements - begun >= part:
            cuts[parts, 0] = r
            cuts[parts, 1] = begun = elements
            parts += 1
        elements += runs[r, 1] - runs[r, 0]
    cuts[parts, 0] = total
    cuts[parts, 1] = elements
    return total, parts, kept
