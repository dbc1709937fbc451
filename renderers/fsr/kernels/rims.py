"""Compiled: rims asked by packets of rays; the method is told in the scalar twin.

A lane that has its answer takes the next ray of the queue. Every ray sees the same
arithmetic in the same order whatever its neighbours do, and so the twin's bits.
"""

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.fsr.kernels.rims_scalar import (
    AFLOAT_MM,
    GAP_MM,
    GAP_SHARE,
    LONGEST_MM,
    REFINED,
    SAME_MM,
    STEP_MM,
    STEPS,
    claim,
    spread_from,
)
from renderers.lanes import (
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
from renderers.lanes import count as count_of
from renderers.shading.kernels.field_reads import is_outside, taps, wall_normals

Floats = NDArray[np.float32]
Ints = NDArray[np.int32]

W = 16
_FREE = W // 4
"""Lanes without a ray that are worth a look at the queue: with eight, a third of all
lanes idle, and with two the looks cost more than they fill."""
_ZERO = np.float32(0)


@njit(cache=True, nogil=True, error_model="numpy")
def list_rims(depth: Floats, first: int, last: int, found: Ints) -> int:
    """Do as the scalar twin."""
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
def directions(m: Floats, axes: Floats, lens: Floats, at: Any, wanted: Any) -> Any:
    """Give pixels' rays in voxels a mm."""
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
    distance: Floats, m: Floats, eye: Floats, axes: Floats, lens: Floats,
    queue: Ints, moved: int, found: Floats,
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
    distance: Floats, m: Floats, eye: Floats, axes: Floats, lens: Floats,
    depth: Floats, first: int, last: int, queue: Ints, state: NDArray[np.uint8],
    found: Floats,
) -> tuple[int, int]:  # fmt: skip
    """Do as the scalar twin."""
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
