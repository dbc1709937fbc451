"""The rims of a splatted picture, one ray after the other: slow and obvious."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderers.fsr.kernels.rims import (
    AFLOAT_MM,
    GAP_MM,
    GAP_SHARE,
    LONGEST_MM,
    REFINED,
    SAME_MM,
    STEP_MM,
    STEPS,
)
from renderers.shading.kernels.field_reads import tap

F32 = NDArray[np.float32]
f32 = np.float32


def list_rims(depth: F32, first: int, last: int) -> list[int]:
    """List the pixels of some rows that have a neighbour much deeper than they are."""
    height, width = depth.shape
    found = []
    for y in range(max(first, 1), min(last, height - 1)):
        for x in range(1, width - 1):
            t = depth[y, x]
            deepest = max(
                depth[y - 1, x], depth[y + 1, x], depth[y, x - 1], depth[y, x + 1]
            )
            if deepest > t + (GAP_MM + GAP_SHARE * t) and t < f32(1e6):
                found.append(y * width + x)
    return found


def wall_depth(distance: F32, eye: F32, step: F32, splats: np.float32) -> Any:
    """Sphere-trace from the splats' depth on; -1 where no wall can be told.

    step: voxels per millimetre along the ray.
    """
    far = np.array(distance.shape[::-1], np.float32) - f32(1)
    t, before, air = splats, f32(-1), f32(AFLOAT_MM)

    def look(at: Any) -> Any:
        return tap(distance, *(eye[i] + at * step[i] for i in range(3)))

    for _ in range(STEPS):
        place = [eye[i] + t * step[i] for i in range(3)]
        if not all(0 <= p <= f for p, f in zip(place, far, strict=True)):
            break
        d = tap(distance, *place)
        if before < 0 and d > -AFLOAT_MM:
            return t
        if d >= 0:
            for _ in range(REFINED):
                middle = before + (t - before) * air / (air - d)
                between = look(middle)
                if between < 0:
                    before, air = middle, between
                else:
                    t, d = middle, between
            return before + (t - before) * air / (air - d)
        before, air = t, d
        t = t + max(f32(-0.95) * d, STEP_MM)
        if t > LONGEST_MM:
            break
    return f32(-1)


def sharpen(
    distance: F32, m: F32, eye: F32, axes: F32, lens: F32, depth: F32
) -> tuple[int, dict[int, np.float32]]:
    """Ask all rims, and the neighbours of what moves; give their number and depths."""
    height, width = depth.shape
    queue = list_rims(depth, 0, height)
    asked, moved = set(queue), {}
    for at in queue:  # grows on the way
        y, x = divmod(at, width)
        a, b, c = lens[y, x]
        ray = [a * axes[0, i] + b * axes[1, i] + c * axes[2, i] for i in range(3)]
        step = np.array(
            [m[i, 0] * ray[0] + m[i, 1] * ray[1] + m[i, 2] * ray[2] for i in range(3)]
        )
        t = wall_depth(distance, eye, step, depth[y, x])
        if t < 0 or abs(t - depth[y, x]) < SAME_MM:
            continue
        moved[at] = t
        for v, u in ((y + 1, x), (y - 1, x), (y, x + 1), (y, x - 1)):
            beside = v * width + u
            if not (0 <= v < height and 0 <= u < width) or beside in asked:
                continue
            if depth[v, u] < f32(1e6):
                asked.add(beside)
                queue.append(beside)
    return len(asked), moved
