"""Rims of a splatted picture found by rays: look past the discs over a free edge.

A disc on a rim reaches beyond it, by a different amount from disc to disc: rims of the
splats alone are ragged by half a spacing. Where a pixel's neighbour lies much deeper
and its splats float before the wall, its own ray goes on through the distance field;
where it passes the rim, the pixels beside it are looked at, too, until rays agree with
the splats.

Rays are traced in packets: a lane that has its answer takes the next ray of the queue.
Every ray sees the same arithmetic in the same order whatever its neighbours do.
"""

import numpy as np
from numba import njit

from renderers.fsr.kernels.array_types import F32, I32, U8, Lanes
from renderers.shading.kernels.field_reads import is_outside, taps, wall_normals
from renderers.simd import (
    absolute,
    any_,
    bits,
    full,
    gather,
    lanes,
    load,
    load_where,
    maximum,
    put_rows4,
    rank,
    rows4,
    select,
    store_packed,
)
from renderers.simd import count as count_of

f32 = np.float32
GAP_MM = f32(0.4)
GAP_SHARE = f32(0.03)
"""A neighbour deeper by this much and this share of the depth is another wall's."""
AFLOAT_MM = f32(0.002)
"""Where splats lie so far before the wall their discs stand over its edge."""
SAME_MM = f32(0.35)
"""Rays and splats that differ by less mean the same wall."""
STEP_MM = f32(0.2)
STEPS = 160
LONGEST_MM = f32(150)
REFINED = 2
"""Times that a straight line through the last distances in air and in the wall is tried
for where the surface is, before it is taken: the field is nearly straight there."""
UNTRACED, TRACED = 0, 1
W = 16
_FREE = W // 4
"""Lanes without a ray that are worth a look at the queue: with eight, a third of all
lanes idle, and with two the looks cost more than they fill."""
_ZERO = np.float32(0)


@njit(cache=True, nogil=True, error_model="numpy")
def claim(queue: I32, count: int, state: U8) -> int:
    """Keep the pixels of a queue that no other part traces; return how many."""
    kept = 0
    for n in range(count):
        at = queue[n]
        if state[at] == UNTRACED:
            state[at] = TRACED
            queue[kept] = at
            kept += 1
    return kept


@njit(cache=True, nogil=True, error_model="numpy")
def spread_from(
    queue: I32, first: int, last: int, count: int, width: int,
    state: U8, depth: F32, into: I32,
) -> int:  # fmt: skip
    """Queue the neighbours of the moved pixels ``queue[first:last]``, too.

    They are added to `into` from place `count` on. Returns the new count.
    """
    height = depth.shape[0]
    for n in range(first, last):
        at = queue[n]
        y, x = at // width, at % width
        for k in range(4):
            v = y + (1 if k == 0 else -1 if k == 1 else 0)
            u = x + (1 if k == 2 else -1 if k == 3 else 0)
            if not (0 <= v < height and 0 <= u < width):
                continue
            if state[v * width + u] == UNTRACED and depth[v, u] < f32(1e6):
                state[v * width + u] = TRACED
                into[count] = v * width + u
                count += 1
    return count


@njit(cache=True, nogil=True, error_model="numpy")
def write_moved(queue: I32, moved: I32, found: F32, depth: F32, normal: F32) -> None:
    """Write what all parts have found into the picture.

    queue: ``(parts, n)``, of which each part has `moved` pixels at its begin.
    """
    width = depth.shape[1]
    for part in range(queue.shape[0]):
        for n in range(moved[part]):
            at = queue[part, n]
            y, x = at // width, at % width
            depth[y, x] = found[at, 0]
            for c in range(3):
                normal[y, x, c] = found[at, c + 1]


@njit(cache=True, nogil=True, error_model="numpy")
def list_rims(depth: F32, first: int, last: int, found: I32) -> int:
    """List the pixels of rows ``first..last`` with a much deeper neighbour.

    found: takes their numbers. Returns how many there are.
    """
    height, width = depth.shape
    n = 0
    for y in range(max(first, 1), min(last, height - 1)):
        for x in range(1, width - 1, W):
            at = y * width + x
            inside = lanes(W) < np.int32(width - 1 - x)
            t = load_where(depth, at, inside)
            above = load_where(depth, at - width, inside)
            below = load_where(depth, at + width, inside)
            left = load_where(depth, at - 1, inside)
            right = load_where(depth, at + 1, inside)
            most = maximum(maximum(above, below), maximum(left, right))
            met = (most > t + (GAP_MM + GAP_SHARE * t)) & (t < np.float32(1e6))
            met &= inside
            if bits(met) != 0:
                store_packed(found, n, lanes(W) + np.int32(at), met)
                n += count_of(met)
    return n


@njit(cache=True, nogil=True, error_model="numpy")
def directions(m: F32, axes: F32, lens: F32, at: Lanes, wanted: Lanes) -> Lanes:
    """Return pixels' rays in voxels a mm."""
    to = at * 3
    a = gather(lens, to, wanted)
    b = gather(lens, to + 1, wanted)
    c = gather(lens, to + 2, wanted)
    dx = a * axes[0, 0] + b * axes[1, 0] + c * axes[2, 0]
    dy = a * axes[0, 1] + b * axes[1, 1] + c * axes[2, 1]
    dz = a * axes[0, 2] + b * axes[1, 2] + c * axes[2, 2]
    return (
        m[0, 0] * dx + m[0, 1] * dy + m[0, 2] * dz,
        m[1, 0] * dx + m[1, 1] * dy + m[1, 2] * dz,
        m[2, 0] * dx + m[2, 1] * dy + m[2, 2] * dz,
    )


@njit(cache=True, nogil=True, error_model="numpy")
def find_normals(
    distance: F32, m: F32, eye: F32, axes: F32, lens: F32,
    queue: I32, moved: int, found: F32,
) -> None:  # fmt: skip
    """Put the walls' normals beside the depths of the pixels that moved."""
    spare = np.int32(found.shape[0] - 1)
    for first in range(0, moved, W):
        wanted = lanes(W) < np.int32(moved - first)
        at = select(wanted, load(queue, first, W), spare)
        t, _, _, _ = rows4(found, at)
        vx, vy, vz = directions(m, axes, lens, at, wanted)
        x = eye[0] + t * vx
        y = eye[1] + t * vy
        z = eye[2] + t * vz
        nx, ny, nz = wall_normals(distance, m, x, y, z)
        put_rows4(found, at, t, nx, ny, nz)


@njit(cache=True, nogil=True, error_model="numpy")
def sharpen(
    distance: F32, m: F32, eye: F32, axes: F32, lens: F32,
    depth: F32, first: int, last: int, queue: I32, state: U8,
    found: F32,
) -> tuple[int, int]:  # fmt: skip
    """Trace the rims of rows ``first..last``, and the neighbours of what moves.

    queue: large enough for the whole picture; the numbers of the pixels that moved are
    left at its begin. state: one for each pixel, zeros at first, shared by all parts of
    a picture. found: ``(pixels + 1, 4)``, depth and normal of what moved, shared, too;
    the last row takes what is not wanted. Neighbours may be of other rows. What a pixel
    gets depends on its own ray and splats only, which stay as they are: neither order
    nor parts change a bit. Returns how many were traced and how many moved to another
    wall.
    """
    width = depth.shape[1]
    spare = np.int32(found.shape[0] - 1)
    count = claim(queue, list_rims(depth, first, last, queue), state)
    done = moved = 0
    at = full(np.int32(0), W)
    live = at > 0
    # steps along the ray, and bisections to go where it has come to the wall
    steps = full(np.int32(0), W)
    left = full(np.int32(0), W)
    splats = full(_ZERO, W)
    vx = full(_ZERO, W)
    vy = full(_ZERO, W)
    vz = full(_ZERO, W)
    # the last place in air and the next, and the distances there
    before = full(_ZERO, W)
    air = full(_ZERO, W)
    t = full(_ZERO, W)
    inside = full(_ZERO, W)
    while True:
        working = count_of(live)
        if done < count and working <= W - _FREE:
            number = rank(~live) + np.int32(done)
            fresh = ~live & (number < np.int32(count))
            at = select(fresh, gather(queue, number, fresh), at)
            splats = select(fresh, gather(depth, at, fresh), splats)
            x, y, z = directions(m, axes, lens, at, fresh)
            vx = select(fresh, x, vx)
            vy = select(fresh, y, vy)
            vz = select(fresh, z, vz)
            steps = select(fresh, np.int32(STEPS), steps)
            left = select(fresh, np.int32(0), left)
            before = select(fresh, np.float32(-1), before)
            air = select(fresh, AFLOAT_MM, air)
            t = select(fresh, splats, t)
            live |= fresh
            done += count_of(fresh)
        elif working == 0:
            break
        refined = left > 0
        between = before + (t - before) * air / (air - inside)
        s = select(refined, between, t)
        x = eye[0] + s * vx
        y = eye[1] + s * vy
        z = eye[2] + s * vz
        d = taps(distance, x, y, z)
        in_air = d < _ZERO
        # bisection: the wall lies between the last places on either side of it
        at_wall = refined & ~in_air
        before = select(in_air, s, before)
        t = select(at_wall, s, t)
        inside = select(at_wall, d, inside)
        left = select(refined, left - 1, left)
        # a march's first step has nothing before it
        out = is_outside(distance, x, y, z)
        first_step = steps == STEPS
        ended = ~refined & (out | (first_step & (d > -AFLOAT_MM)))
        hits = ~refined & ~in_air
        left = select(hits, np.int32(REFINED), left)
        inside = select(hits, d, inside)
        air = select(in_air, d, air)
        steps = select(refined, steps, steps - 1)
        onwards = ~refined & in_air
        t = select(onwards, t + maximum(np.float32(-0.95) * d, STEP_MM), t)
        ended |= onwards & ((t > LONGEST_MM) | (steps == 0))
        arrived = refined & (left == 0)
        depth_found = before + (t - before) * air / (air - inside)
        hit = live & arrived & ~(absolute(depth_found - splats) < SAME_MM)
        live &= ~(ended | arrived)
        if any_(hit):
            place = select(hit, at, spare)
            zero = full(_ZERO, W)
            put_rows4(found, place, depth_found, zero, zero, zero)
            store_packed(queue, moved, at, hit)
            more = moved + count_of(hit)
            count = spread_from(queue, moved, more, count, width, state, depth, queue)
            moved = more
    find_normals(distance, m, eye, axes, lens, queue, moved, found)
    return done, moved
