"""Compiled: look past the discs that stand over a free edge.

A disc on a rim reaches beyond it, by a different amount from disc to disc: rims of the
splats alone are ragged by half a spacing. Where a pixel's neighbour lies much deeper
and its splats float before the wall, its own ray goes on through the distance field;
where it passes the rim, the pixels beside it are looked at, too, until rays agree with
the splats.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.shading.kernels.path_tracing import wall_normal
from renderers.shading.kernels.virtual_lights import tap

f32 = np.float32
Floats = NDArray[np.float32]
Ints = NDArray[np.int32]

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

NOT_ASKED, ASKED = 0, 1


@njit(cache=True, nogil=True, error_model="numpy")
def list_rims(depth: Floats, first: int, last: int, found: Ints) -> int:
    """List the pixels of rows ``first..last`` with a much deeper neighbour.

    found: room for their numbers. Returns how many there are.
    """
    height, width = depth.shape
    n = 0
    for y in range(max(first, 1), min(last, height - 1)):
        above, here, below = depth[y - 1], depth[y], depth[y + 1]
        for x in range(1, width - 1):
            t = here[x]
            most = max(max(above[x], below[x]), max(here[x - 1], here[x + 1]))
            # beyond an empty pixel there is no wall to look for
            if most > t + (GAP_MM + GAP_SHARE * t) and t < f32(1e6):
                found[n] = y * width + x
                n += 1
    return n


@njit(cache=True, nogil=True, error_model="numpy")
def ask(
    distance: Floats, m: Floats, eye: Floats, dx: np.float32, dy: np.float32,
    dz: np.float32, splats: np.float32,
) -> np.float32:  # fmt: skip
    """Give the depth of the wall along a ray, or -1 where it cannot be told.

    m, eye: voxels from mm. splats: the depth that they gave.
    """
    nz, ny, nx = distance.shape
    vx = m[0, 0] * dx + m[0, 1] * dy + m[0, 2] * dz
    vy = m[1, 0] * dx + m[1, 1] * dy + m[1, 2] * dz
    vz = m[2, 0] * dx + m[2, 1] * dy + m[2, 2] * dz
    t = splats
    before = f32(-1)
    air = AFLOAT_MM
    for _ in range(STEPS):
        x, y, z = eye[0] + t * vx, eye[1] + t * vy, eye[2] + t * vz
        if not (
            f32(0) <= x <= f32(nx - 1)
            and f32(0) <= y <= f32(ny - 1)
            and f32(0) <= z <= f32(nz - 1)
        ):
            return f32(-1)
        d = tap(distance, x, y, z)
        if before < f32(0) and d > -AFLOAT_MM:
            return t
        if d >= f32(0):
            for _ in range(REFINED):
                middle = before + (t - before) * air / (air - d)
                between = tap(
                    distance, eye[0] + middle * vx, eye[1] + middle * vy,
                    eye[2] + middle * vz,
                )  # fmt: skip
                if between < f32(0):
                    before, air = middle, between
                else:
                    t, d = middle, between
            return before + (t - before) * air / (air - d)
        before, air = t, d
        t += max(f32(-0.95) * d, STEP_MM)
        if t > LONGEST_MM:
            break
    return f32(-1)


@njit(cache=True, nogil=True, error_model="numpy")
def claim(queue: Ints, count: int, state: NDArray[np.uint8]) -> int:
    """Keep the pixels of a queue that no other part asks; return how many."""
    kept = 0
    for n in range(count):
        at = queue[n]
        if state[at] == NOT_ASKED:
            state[at] = ASKED
            queue[kept] = at
            kept += 1
    return kept


@njit(cache=True, nogil=True, error_model="numpy")
def spread_from(
    queue: Ints, first: int, last: int, count: int, width: int,
    state: NDArray[np.uint8], depth: Floats, into: Ints,
) -> int:  # fmt: skip
    """Ask the neighbours of the moved pixels ``queue[first:last]``, too.

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
            if state[v * width + u] == NOT_ASKED and depth[v, u] < f32(1e6):
                state[v * width + u] = ASKED
                into[count] = v * width + u
                count += 1
    return count


@njit(cache=True, nogil=True, error_model="numpy")
def sharpen(
    distance: Floats, m: Floats, eye: Floats, axes: Floats, lens: Floats,
    depth: Floats, first: int, last: int, queue: Ints, state: NDArray[np.uint8],
    found: Floats,
) -> tuple[int, int]:  # fmt: skip
    """Ask the rims of rows ``first..last``, and the neighbours of what moves.

    queue: with room for the whole picture; the numbers of the pixels that moved are
    left at its begin. state: one for each pixel, zeros at first, shared by all parts of
    a picture. found: ``(pixels + 1, 4)``, depth and normal of what moved, shared, too;
    the last row takes what is not wanted. Neighbours may be of other rows. What a pixel
    gets depends on its own ray and splats only, which stay as they are: neither order
    nor parts change a bit. Returns how many were asked and how many moved to another
    wall.
    """
    width = depth.shape[1]
    count = claim(queue, list_rims(depth, first, last, queue), state)
    done = moved = 0
    while done < count:
        at = queue[done]
        done += 1
        y, x = at // width, at % width
        a, b, c = lens[y, x, 0], lens[y, x, 1], lens[y, x, 2]
        dx = a * axes[0, 0] + b * axes[1, 0] + c * axes[2, 0]
        dy = a * axes[0, 1] + b * axes[1, 1] + c * axes[2, 1]
        dz = a * axes[0, 2] + b * axes[1, 2] + c * axes[2, 2]
        splats = depth[y, x]
        t = ask(distance, m, eye, dx, dy, dz, splats)
        if t < f32(0) or abs(t - splats) < SAME_MM:
            continue
        found[at, 0] = t
        found[at, 1], found[at, 2], found[at, 3] = wall_normal(
            distance,
            m,
            eye[0] + t * (m[0, 0] * dx + m[0, 1] * dy + m[0, 2] * dz),
            eye[1] + t * (m[1, 0] * dx + m[1, 1] * dy + m[1, 2] * dz),
            eye[2] + t * (m[2, 0] * dx + m[2, 1] * dy + m[2, 2] * dz),
        )
        # never overtakes what is still to be asked
        queue[moved] = at
        moved += 1
        count = spread_from(queue, moved - 1, moved, count, width, state, depth, queue)
    return done, moved


@njit(cache=True, nogil=True, error_model="numpy")
def settle(
    queue: Ints, moved: Ints, found: Floats, depth: Floats, normal: Floats
) -> None:
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
