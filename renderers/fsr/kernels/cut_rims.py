"""Where rays meet what a cut has opened.

Discs stand out over the rims of a cut, blend its faces where they meet, and are too
coarse for the thin leaves that it leaves standing. So each ray that comes near a face
is followed through the deformation itself, from where the first ball begins.

Places are mm along the array's axes, from its first voxel, in float64.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from renderers.fsr.kernels.array_types import F32, F64, U8
from renderers.fsr.kernels.draw_surfels import GeometryPlanes
from renderers.scene.kernels.deflect import (
    bend,
    bend_gradient,
    clear_way,
    entry,
    slope_of_opening,
)
from renderers.shading.kernels.field_reads import tap

f32 = np.float32

LEAST_STEP_MM = 0.03
MOST_STEPS = 400
HALVINGS = 8
"""Of the last step: then it is 1e-4 mm."""


class DeflectedField(NamedTuple):
    """A distance field and its deflection.

    distance: of the undeformed surface (mm), negative in air. per_mm: voxels. maps: of
    the deflectors. stretch: the most that lengths grow by.
    """

    distance: F32
    per_mm: F64
    maps: F64
    stretch: float


@njit(cache=True, nogil=True, error_model="numpy")
def look(
    distance: F32, per_mm: F64, maps: F64, place: F64, seen: F64, trail: F64
) -> tuple[float, float]:
    """Return the distance seen at a place (mm, negative in air) and the opening.

    per_mm: voxels. seen: (3,), becomes the place of the undeformed tissue.
    """
    seen[:] = place
    opening = bend(maps, seen, trail)
    found = tap(
        distance,
        f32(seen[0] * per_mm[0]),
        f32(seen[1] * per_mm[1]),
        f32(seen[2] * per_mm[2]),
    )
    return float(found), opening


@njit(cache=True, nogil=True, error_model="numpy")
def follow(
    distance: F32, per_mm: F64, maps: F64, stretch: float, eye: F64, ray: F64,
    start: float, places: F64, trail: F64,
) -> float:  # fmt: skip
    """Return the depth at which a ray comes from air into tissue, or -1 if it does not.

    start: the depth from which it is followed. places: (2, 3), scratch.
    """
    place, seen = places[0], places[1]
    at, before = start, -1.0
    for _ in range(MOST_STEPS):
        for k in range(3):
            place[k] = eye[k] + at * ray[k]
            if not 0.0 <= place[k] * per_mm[k] <= distance.shape[2 - k] - 1.0:
                return -1.0
        inside, opening = look(distance, per_mm, maps, place, seen, trail)
        if min(inside, opening) >= 0.0:
            if before < 0.0:
                return -1.0
            break
        before = at
        at += max(clear_way(inside, opening, stretch), LEAST_STEP_MM)
    else:
        return -1.0
    for _ in range(HALVINGS):
        middle = 0.5 * (before + at)
        for k in range(3):
            place[k] = eye[k] + middle * ray[k]
        inside, opening = look(distance, per_mm, maps, place, seen, trail)
        if min(inside, opening) < 0.0:
            before = middle
        else:
            at = middle
    return at


@njit(cache=True, nogil=True, error_model="numpy")
def gradient_at(distance: F32, per_mm: F64, seen: F64, gradient: F64) -> None:
    """Find Sobel's gradient between voxels, per mm; it is clamped at the grid's faces.

    What trilinear interpolation makes of the gradients of voxels (Sobel's 26-neighbour
    estimate, the normals of both renderers): products of four weights along each axis.
    """
    smooth, rise = np.empty((3, 4)), np.empty((3, 4))
    low = np.empty(3, np.int64)
    for k in range(3):
        top = distance.shape[2 - k] - 1
        at = min(max(seen[k] * per_mm[k], 0.0), float(top))
        low[k] = min(int(at), top - 1)
        f = at - low[k]
        smooth[k, 0], smooth[k, 1] = 0.25 * (1.0 - f), 0.25 * (2.0 - f)
        smooth[k, 2], smooth[k, 3] = 0.25 * (1.0 + f), 0.25 * f
        half = 0.5 * per_mm[k]
        rise[k, 0], rise[k, 1] = half * (f - 1.0), -half * f
        rise[k, 2], rise[k, 3] = half * (1.0 - f), half * f
    gradient[:] = 0.0
    for c in range(4):
        z = min(max(low[2] + c - 1, 0), distance.shape[0] - 1)
        for b in range(4):
            y = min(max(low[1] + b - 1, 0), distance.shape[1] - 1)
            level = slope = 0.0
            for a in range(4):
                x = min(max(low[0] + a - 1, 0), distance.shape[2] - 1)
                value = float(distance[z, y, x])
                level += smooth[0, a] * value
                slope += rise[0, a] * value
            gradient[0] += smooth[2, c] * smooth[1, b] * slope
            gradient[1] += smooth[2, c] * rise[1, b] * level
            gradient[2] += rise[2, c] * smooth[1, b] * level


@njit(cache=True, nogil=True, error_model="numpy")
def trace_cut_rims(
    field: DeflectedField, seam_mm: float, eye: F64, lens_axes: F64, world_axes: F64,
    lens: F32, surface: GeometryPlanes, done: U8, first: int, last: int,
) -> tuple[int, int]:  # fmt: skip
    """Correct the pixels of rows ``first..last`` that show what is near a face.

    lens_axes: rows right, up and forward, along the array's axes. world_axes: columns,
    the array's axes in the world. seam_mm: so near. done: one for each pixel,
    becomes 1 where the ray's place was taken. Returns how many rays were traced and
    how many pixels were corrected.
    """
    distance, per_mm, maps, stretch = field
    depth, normal, coverage = surface
    followed = found = 0
    trail, places = np.empty((len(maps), 3)), np.empty((2, 3))
    place, seen = places[0], places[1]
    ray, gradient = np.empty(3), np.empty(3)
    for y in range(first, last):
        for x in range(depth.shape[1]):
            length = 0.0
            for k in range(3):
                ray[k] = 0.0
                for axis in range(3):
                    ray[k] += float(lens[y, x, axis]) * lens_axes[axis, k]
                length += ray[k] * ray[k]
            if length == 0.0:
                continue
            ray /= math.sqrt(length)
            start = entry(maps, eye, ray)
            shown = float(depth[y, x])
            if coverage[y, x] == f32(0):
                shown = np.inf
            if not start < shown:
                continue
            followed += 1
            at = follow(distance, per_mm, maps, stretch, eye, ray, start, places, trail)
            if at < 0.0:
                continue
            near = np.inf
            if shown < np.inf:
                for k in range(3):
                    place[k] = eye[k] + shown * ray[k]
                _, near = look(distance, per_mm, maps, place, seen, trail)
            for k in range(3):
                place[k] = eye[k] + at * ray[k]
            inside, opening = look(distance, per_mm, maps, place, seen, trail)
            if min(near, opening) >= seam_mm:
                continue
            gradient_at(distance, per_mm, seen, gradient)
            bend_gradient(maps, trail, gradient)
            if opening < inside:
                slope_of_opening(maps, place, seen, trail, gradient)
            steep = math.sqrt(np.sum(gradient * gradient))
            # on a ball's rim, where a face ends, there may be no slope
            if not steep > 0.0:
                continue
            depth[y, x] = f32(at)
            coverage[y, x] = f32(1)
            for k in range(3):
                turned = 0.0
                for axis in range(3):
                    turned += world_axes[k, axis] * gradient[axis]
                normal[y, x, k] = f32(-turned / steep)
            done[y * depth.shape[1] + x] = 1
            found += 1
    return followed, found
