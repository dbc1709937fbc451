"""Creases beside cuts in a splatted picture, settled by rays.

Where a cut meets the old surface, or another cut, the surface has an edge. Discs stand
out over it, round it off or leave a gap. So the rays of pixels near cuts are followed
to the field's zero where splats lie beside it, where neighbours look elsewhere, or
where nothing was drawn; the pixel gets the place and the normal that its ray finds.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from renderers.fsr.kernels.array_types import F32, I32, U8, Lanes
from renderers.fsr.kernels.draw_surfels import GeometryPlanes
from renderers.fsr.kernels.rims import W, directions
from renderers.shading.kernels.elementary import along_axes, rotated
from renderers.shading.kernels.field_reads import (
    DistanceField,
    is_outside,
    taps,
)
from renderers.shading.kernels.wound_cubes import CUT
from renderers.simd import (
    absolute,
    any_,
    count,
    full,
    gather,
    gather_u8,
    lanes,
    load_where,
    maximum,
    minimum,
    put_rows4,
    rank,
    rows4,
    select,
    sqrt,
    store_packed,
    unzip3,
)
from renderers.simd import f32 as to_real
from renderers.simd import i32 as to_whole

f32 = np.float32

OFF_MM, OFF_SHARE = f32(0.004), f32(0.002)
"""Splats so far beside the surface, and by such a share of the depth, are corrected."""
SAME_MM = f32(0.35)
"""Rays and splats that differ by less mean the same wall."""
LEAST_COSINE = f32(0.97)
"""Neighbours' normals that differ by more mean an edge."""
GAP_SHARE = f32(0.05)
"""Neighbours that are farther by this share of the depth lie beyond an edge."""
HOLE = 5
"""Pixels from an empty one at which something must be near a cut."""
BACK_MM = f32(0.4)
TIMES_BACK = 4
"""A ray is followed from so far before its splats, or as many times as far."""
LEAST_STEP_MM = f32(0.04)
MOST_STEPS = 200
SECANTS = 3
"""Times that a straight line tells where the surface is."""

SHIFT = 2
"""Voxels along a side of a cube that may have a crease, as a power of two."""

_FREE = W // 4
"""Lanes without a ray that are worth a look at the queue."""
_ZERO = f32(0)


class Eye(NamedTuple):
    """How a picture's pixels look at a field.

    field: the distance as the eye sees it. axes: rows right, up and forward, in the
    world. lens: ``(h, w, 3)``.
    """

    field: DistanceField
    axes: F32
    lens: F32


@njit(cache=True, nogil=True, error_model="numpy")
def list_creases(
    eye: Eye, cubes: U8, surface: GeometryPlanes, first: int, last: int, queue: I32,
    starts: F32, state: U8,
) -> int:  # fmt: skip
    """List the pixels of rows ``first..last`` whose rays are to be followed.

    cubes: see `mark_cubes`. queue, starts: take their numbers and the depths of
    what is nearest around them. state: becomes 1 for each. Returns how many there are.
    """
    field, axes, lens = eye
    depth, normal, _ = surface
    distance, m, origin = field
    height, width = depth.shape
    nc, nb, na = cubes.shape
    n = 0
    for y in range(max(first, 1), min(last, height - 1)):
        for x in range(1, width - 1, W):
            at = y * width + x
            left = width - 1 - x
            inside = lanes(W) < np.int32(left)
            t = load_where(depth, at, inside)
            above = load_where(depth, at - width, inside)
            below = load_where(depth, at + width, inside)
            before = load_where(depth, at - 1, inside)
            after = load_where(depth, at + 1, inside)
            least = minimum(minimum(above, below), minimum(before, after))
            most = maximum(maximum(above, below), maximum(before, after))
            near = minimum(least, t)
            empty = inside & ~(t < f32(1e6))
            if any_(empty):
                near = minimum(near, around(depth, at, y, empty))
            met = inside & (near < f32(1e6))
            if not any_(met):
                continue
            second = lanes(W) < np.int32(3 * left - W)
            third = lanes(W) < np.int32(3 * left - 2 * W)
            whole = lanes(W) < np.int32(3 * left)
            a, b, c = unzip3(
                load_where(lens, 3 * at, whole),
                load_where(lens, 3 * at + W, second),
                load_where(lens, 3 * at + 2 * W, third),
            )
            # beyond the lens there is nothing to be seen
            met &= absolute(a) + absolute(b) + absolute(c) > f32(0)
            dx, dy, dz = along_axes(axes, a, b, c)
            vx, vy, vz = rotated(m, dx, dy, dz)
            s = minimum(near, f32(1e6))
            u = to_whole(origin[0] + s * vx)
            v = to_whole(origin[1] + s * vy)
            w = to_whole(origin[2] + s * vz)
            u = u >> SHIFT
            v = v >> SHIFT
            w = w >> SHIFT
            met &= (u >= 0) & (u < np.int32(na)) & (v >= 0) & (v < np.int32(nb))
            met &= (w >= 0) & (w < np.int32(nc))
            cube = u + np.int32(na) * (v + np.int32(nb) * w)
            met &= (gather_u8(cubes, cube, met) & CUT) != 0
            if not any_(met):
                continue
            s = minimum(t, f32(1e6))
            d = taps(
                distance, origin[0] + s * vx, origin[1] + s * vy, origin[2] + s * vz
            )
            wanted = absolute(d) > OFF_MM + OFF_SHARE * s
            wanted |= most - near > GAP_SHARE * near
            nx, ny, nz = normals(normal, at, whole, second, third)
            for to in (-width, width, -1, 1):
                ox, oy, oz = normals(normal, at + to, whole, second, third)
                wanted |= nx * ox + ny * oy + nz * oz < LEAST_COSINE
            met &= wanted
            if any_(met):
                store_packed(queue, n, lanes(W) + np.int32(at), met)
                store_packed(starts, n, near, met)
                more = n + count(met)
                for q in range(n, more):
                    state[queue[q]] = 1
                n = more
    return n


@njit(cache=True, nogil=True, error_model="numpy")
def around(depth: F32, at: int, y: int, wanted: Lanes) -> Lanes:
    """Return the least depth a few pixels up, down and beside a run of pixels."""
    height, width = depth.shape
    reach = HOLE if HOLE <= y < height - HOLE else 0
    far = f32(np.inf)
    found = select(wanted, load_where(depth, at - HOLE, wanted), far)
    for to in (at + HOLE, at - reach * width, at + reach * width):
        found = minimum(found, select(wanted, load_where(depth, to, wanted), far))
    return found


@njit(cache=True, nogil=True, error_model="numpy")
def normals(
    normal: F32, at: int, whole: U8, second: U8, third: U8
) -> tuple[F32, F32, F32]:
    """Return the normals of a run of pixels."""
    x, y, z = unzip3(
        load_where(normal, 3 * at, whole),
        load_where(normal, 3 * at + W, second),
        load_where(normal, 3 * at + 2 * W, third),
    )
    return x, y, z


@njit(cache=True, nogil=True, error_model="numpy")
def sobel_normals(
    distance: F32, m: F32, x: Lanes, y: Lanes, z: Lanes
) -> tuple[Lanes, Lanes, Lanes]:
    """Return unit normals towards air at voxel coordinates, along world axes.

    Sobel's gradient, interpolated between voxels: the normals of both renderers. Near
    an edge no other estimate will do. m: voxels a mm. See `cut_rims.gradient_at`.
    """
    nz, ny, nx = distance.shape
    i = minimum(maximum(to_whole(x), 1), np.int32(nx - 3))
    j = minimum(maximum(to_whole(y), 1), np.int32(ny - 3))
    k = minimum(maximum(to_whole(z), 1), np.int32(nz - 3))
    fx, fy, fz = x - to_real(i), y - to_real(j), z - to_real(k)
    every = i > 0
    at = i + np.int32(nx) * j + np.int32(nx * ny) * k
    zero = full(_ZERO, W)
    gx, gy, gz = zero, zero, zero
    for c in range(4):
        smooth_z, rise_z = weights(fz, c)
        level_z, slope_z, level_y = zero, zero, zero
        for b in range(4):
            smooth_y, rise_y = weights(fy, b)
            line = at + np.int32((c - 1) * nx * ny + (b - 1) * nx)
            p = gather(distance, line - 1, every)
            q = gather(distance, line, every)
            r = gather(distance, line + 1, every)
            s = gather(distance, line + 2, every)
            # twice the slope, four times the level
            slope = (r - p) + fx * ((s - q) - (r - p))
            level = (p + q + q + r) + fx * ((q + r + r + s) - (p + q + q + r))
            level_z += smooth_y * level
            slope_z += smooth_y * slope
            level_y += rise_y * level
        gx += smooth_z * slope_z
        gy += smooth_z * level_y
        gz += rise_z * level_z
    # what is common to the three goes with the length
    wx, wy, wz = along_axes(m, f32(2) * gx, gy, gz)
    scale = f32(-1) / sqrt(wx * wx + wy * wy + wz * wz + f32(1e-12))
    return wx * scale, wy * scale, wz * scale


@njit(cache=True, nogil=True, error_model="numpy")
def weights(f: Lanes, n: int) -> tuple[Lanes, Lanes]:
    """Return the n-th of four weights of a smoothed level and of a slope.

    f: where between the second voxel and the third.
    """
    one = f32(1)
    if n == 0:
        return f32(0.25) * (one - f), f32(0.5) * (f - one)
    if n == 1:
        return f32(0.25) * (f32(2) - f), f32(-0.5) * f
    if n == 2:
        return f32(0.25) * (one + f), f32(0.5) * (one - f)
    return f32(0.25) * f, f32(0.5) * f


@njit(cache=True, nogil=True, error_model="numpy")
def trace_creases(eye: Eye, queue: I32, starts: F32, found: F32, listed: int) -> int:
    """Follow the rays of the listed pixels.

    starts: mm, where splats are met first around a pixel.
    found: ``(pixels + 1, 4)``, takes depths and normals in the order of the queue, of
    which only those stay that have met a surface; a row to spare for the others.
    Returns how many have. Rays are traced in packets: a lane that has its answer takes
    the next of the queue.
    """
    distance, m, origin = eye.field
    zero = full(_ZERO, W)
    at = full(np.int32(0), W)
    live = at > 0
    # steps to go, before that places to begin at, and straight lines to try
    steps, backs, left = at, at, at
    vx, vy, vz = zero, zero, zero
    # the last place in air and the next, and the distances there
    before, air, t, inside = zero, zero, zero, zero
    done = n = 0
    while True:
        working = count(live)
        if done < listed and working <= W - _FREE:
            number = rank(~live) + np.int32(done)
            fresh = ~live & (number < np.int32(listed))
            at = select(fresh, gather(queue, number, fresh), at)
            begin = gather(starts, number, fresh) - BACK_MM
            x, y, z = directions(m, eye.axes, eye.lens, at, fresh)
            vx, vy, vz = (
                select(fresh, x, vx), select(fresh, y, vy), select(fresh, z, vz)
            )  # fmt: skip
            t = select(fresh, maximum(begin, _ZERO), t)
            steps = select(fresh, np.int32(MOST_STEPS), steps)
            backs = select(fresh, np.int32(TIMES_BACK), backs)
            left = select(fresh, np.int32(0), left)
            live |= fresh
            done += count(fresh)
        elif working == 0:
            break
        refined = left > 0
        between = before + (t - before) * air / (air - inside)
        s = select(refined, between, t)
        x, y, z = origin[0] + s * vx, origin[1] + s * vy, origin[2] + s * vz
        d = taps(distance, x, y, z)
        in_air = d < _ZERO
        # a straight line between the last places on either side of the wall
        wall = refined & ~in_air
        before = select(in_air, s, before)
        air = select(in_air, d, air)
        t = select(wall, s, t)
        inside = select(wall, d, inside)
        left = select(refined, left - 1, left)
        # a ray begins in air: from within tissue it goes back towards the eye
        begins = ~refined & (backs > 0)
        buried = begins & ~in_air
        t = select(buried, maximum(t - BACK_MM, _ZERO), t)
        backs = select(buried, backs - 1, select(begins, np.int32(0), backs))
        ended = buried & (backs == 0)
        met = ~refined & ~buried & ~in_air
        left = select(met, np.int32(SECANTS), left)
        inside = select(met, d, inside)
        onwards = ~refined & in_air
        t = select(onwards, s + maximum(f32(-0.95) * d, LEAST_STEP_MM), t)
        steps = select(onwards, steps - 1, steps)
        ended |= onwards & (is_outside(distance, x, y, z) | (steps == 0))
        arrived = live & refined & (left == 0)
        live &= ~(ended | arrived)
        if any_(arrived):
            depth = before + (t - before) * air / (air - inside)
            number = rank(arrived) + np.int32(n)
            spare = np.int32(found.shape[0] - 1)
            put_rows4(found, select(arrived, number, spare), depth, vx, vy, vz)
            store_packed(queue, n, at, arrived)
            n += count(arrived)
    for first in range(0, n, W):
        wanted = lanes(W) < np.int32(n - first)
        row = select(wanted, lanes(W) + np.int32(first), 0)
        t, vx, vy, vz = rows4(found, row)
        x, y, z = origin[0] + t * vx, origin[1] + t * vy, origin[2] + t * vz
        nx, ny, nz = sobel_normals(distance, m, x, y, z)
        row = select(wanted, row, np.int32(found.shape[0] - 1))
        put_rows4(found, row, t, nx, ny, nz)
    return n


@njit(cache=True, nogil=True, error_model="numpy")
def write_creases(
    surface: GeometryPlanes, queue: I32, listed: int, found: F32, moved: I32, many: int
) -> int:
    """Write what was found into the picture.

    moved: takes the numbers of pixels that went to another wall, from place `many` on.
    Returns how many it has then.
    """
    depth, normal, coverage = surface
    width = depth.shape[1]
    for n in range(listed):
        y, x = queue[n] // width, queue[n] % width
        if not abs(found[n, 0] - depth[y, x]) < SAME_MM:
            moved[many] = queue[n]
            many += 1
        depth[y, x] = found[n, 0]
        coverage[y, x] = f32(1)
        for k in range(3):
            normal[y, x, k] = found[n, k + 1]
    return many


@njit(cache=True, nogil=True, error_model="numpy")
def list_beside(
    moved: I32, many: int, eye: Eye, depth: F32, state: U8, queue: I32, starts: F32
) -> int:
    """List the neighbours of moved pixels whose rays were not followed so far.

    A thin leaf that splats do not show at all is found from its rim. state, queue,
    starts: see `list_creases`. Returns how many there are.
    """
    height, width = depth.shape
    n = 0
    for m in range(many):
        y, x = moved[m] // width, moved[m] % width
        for k in range(4):
            v = y + (1 if k == 0 else -1 if k == 1 else 0)
            u = x + (1 if k == 2 else -1 if k == 3 else 0)
            if not (1 <= v < height - 1 and 1 <= u < width - 1):
                continue
            at = v * width + u
            if state[at] or eye.lens[v, u, 2] == f32(0):
                continue
            state[at] = 1
            near = min(depth[v, u], min(depth[v - 1, u], depth[v + 1, u]))
            starts[n] = min(near, min(depth[v, u - 1], depth[v, u + 1]))
            queue[n] = at
            n += 1
    return n
