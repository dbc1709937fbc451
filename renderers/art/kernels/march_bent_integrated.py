"""March bent rays whose samples are the ends of segments.

As `renderers.art.kernels.march_bent`, for transfer functions integrated between samples
as in `renderers.art.kernels.march_integrated`: what is seen between two places
of the straight ray goes, in density, in a straight line from what is seen at the one to
what is seen at the other. Across the face of a cut it does not: there each half of a
segment has what its own end has, as far as it lies in tissue.
"""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.art.cells.brick_views import CellView, Classification
from renderers.art.kernels.bent_samples import (
    half_outside,
    light_sample,
    opacity,
    trilinear,
)
from renderers.art.kernels.composite_lines import classify, segment
from renderers.art.kernels.march_bent import (
    F32,
    F64,
    MISSING,
    find_corner,
    find_cube,
    leap_bent,
    place,
)
from renderers.art.kernels.opacity import HALF, ONE, ZERO
from renderers.art.kernels.shade_samples import TINY
from renderers.scene.kernels.deflect import bend, bend_gradient


@njit(cache=True, nogil=True, error_model="numpy")
def opening_at(
    maps: F64, line: F32, at: float, spacing: F32, point: F64, trail: F64
) -> float:
    """Give the opening of cuts at a place along a ray, in steps. line: its geometry."""
    for k in range(3):
        point[k] = (line[k] + at * line[3 + k]) * spacing[k]
    return bend(maps, point, trail)


@njit(cache=True, nogil=True, error_model="numpy")
def light_up(
    color: F64, gradient: F64, least_gradient: np.float32, at: F64, way: F64,
    lights: F32, material: F32,
) -> None:  # fmt: skip
    """Light a colour, in place, where its gradient is steep enough; at: mm."""
    steep = math.sqrt(np.sum(gradient * gradient))
    if steep > least_gradient:
        light_sample(gradient / -steep, at, way, lights, material, color)


@njit(cache=True, nogil=True, error_model="numpy")
def march_integrated(
    maps: F64, stretch: float, has_cut: bool,
    order: NDArray[np.int32], geometry: F32, count: NDArray[np.int32],
    cursor: NDArray[np.int32], value: F32, carry: F32, depth: F32,
    front: F32, sums: F32,
    view: CellView, shift: int, clock: int, table: Classification,
    lights: F32, material: F32, spacing: F32,
    least_gradient: np.float32, cutoff: np.float32, renormalise: bool,
    counters: NDArray[np.int64],
) -> None:  # fmt: skip
    """Composite each bent ray's segments until it ends, is opaque, or misses a cell.

    Arguments as `renderers.art.kernels.march_bent.march_classic` has them. front, sums
    and ``cursor[:, 2]``: as in `renderers.art.kernels.march_integrated`; the
    gradient in `front` is turned already.
    """
    each = view.channels
    row = each * ((1 << shift) + 1)
    slab = row * ((1 << shift) + 1)
    point, eye, way, aside = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    trail, other = np.empty((len(maps), 3)), np.empty((len(maps), 3))
    cube, note = np.empty(3, np.int64), np.empty(1, np.int64)
    last, gradient, mean = np.zeros(3), np.zeros(3), np.zeros(3)
    color, beyond = np.empty(3), np.empty(3)
    term = np.empty(4, np.float32)
    narrow = float(spacing.min())
    for ray in order:
        cursor[ray, 3] = 0
        i, end = int(cursor[ray, 0]), int(count[ray])
        if i >= end:
            continue
        joint, within = int(cursor[ray, 2]) >> 1, bool(cursor[ray, 2] & 1)
        line = geometry[ray]
        h = line[6]
        per_sample = stretch * h / narrow * 1.0001
        for k in range(3):
            way[k] = line[3 + k] * spacing[k] / max(h, TINY)
            last[k] = front[ray, 1 + k]
        v0 = front[ray, 0]
        p0, e0, r0, g0, b0 = classify(table, v0)
        t = max((ONE - value[ray, 3]) - carry[ray, 3], ZERO)
        while i < end:
            fi = np.float32(i)
            x, y = line[0] + fi * line[3], line[1] + fi * line[4]
            z = line[2] + fi * line[5]
            opening = place(maps, x, y, z, spacing, view.top, point, trail)
            eye[0], eye[1], eye[2] = x * spacing[0], y * spacing[1], z * spacing[2]
            counters[3] += 1
            far = find_cube(view, point, cube)
            before, parted = np.inf, False
            if has_cut and i > 0:
                before = opening_at(maps, line, i - 1.0, spacing, aside, other)
                # what is seen may jump from one end of the segment to the other
                parted = min(before, opening) <= stretch * h * 1.0001
            joined = joint == i and i > 0
            if far > 0 and not (within and joined):
                jump = leap_bent(
                    maps, point, eye, far, cube, per_sample, has_cut, h, end - i
                )
                counters[2] += jump
                i += jump
                continue
            inside = far == 0
            if inside and i > 0 and not joined and not parted:
                # Where something begins, the empty sample before it is needed, too.
                inside = False
                counters[2] -= 1
                i -= 1
                fi = np.float32(i)
                x, y = line[0] + fi * line[3], line[1] + fi * line[4]
                z = line[2] + fi * line[5]
                place(maps, x, y, z, spacing, view.top, point, trail)
                counters[3] += 1
                find_cube(view, point, cube)
            v1, p1, e1, r1, g1, b1 = v0, p0, ZERO, ZERO, ZERO, ZERO
            reads = inside or not parted
            if reads:
                at = find_corner(view, shift, cube, clock, note)
                if at == MISSING:
                    cursor[ray, 3] = note[0] + 1
                    break
                counters[0] += 1
                fx = np.float32(point[0] - cube[0])
                fy = np.float32(point[1] - cube[1])
                fz = np.float32(point[2] - cube[2])
                v1 = trilinear(view.samples, at, each, row, slab, fx, fy, fz)
                v1 *= view.unit
                p1, e1, r1, g1, b1 = classify(table, v1)
                if each > 1:
                    for k in range(3):
                        gradient[k] = trilinear(
                            view.samples, at + 1 + k, each, row, slab, fx, fy, fz
                        )
                    bend_gradient(maps, trail, gradient)
                    # as rays that stop here take it along
                    for k in range(3):
                        gradient[k] = np.float32(gradient[k])
            alpha = ZERO
            if parted:
                middle = opening_at(maps, line, i - 0.5, spacing, aside, other)
                first, rest = ZERO, ZERO
                if joined:
                    first = opacity(e0 * (half_outside(before, middle) * h))
                if reads:
                    rest = opacity(e1 * (half_outside(middle, opening) * h))
                alpha = first + (ONE - first) * rest
                color[0], color[1], color[2] = r0, g0, b0
                beyond[0], beyond[1], beyond[2] = r1, g1, b1
                if each > 1 and alpha > ZERO:
                    light_up(color, last, least_gradient, eye, way, lights, material)
                    light_up(
                        beyond, gradient, least_gradient, eye, way, lights, material
                    )
                share = first / alpha if alpha > ZERO else ZERO
                for k in range(3):
                    color[k] = share * color[k] + (ONE - share) * beyond[k]
            elif joint == i and i > 0:
                alpha, color[0], color[1], color[2] = segment(
                    table, sums, h, v0, p0, e0, r0, g0, b0, v1, p1, e1, r1, g1, b1
                )
                if each > 1 and alpha > ZERO:
                    for k in range(3):
                        mean[k] = 0.5 * (last[k] + gradient[k])
                        aside[k] = eye[k] - 0.5 * h * way[k]
                    light_up(color, mean, least_gradient, aside, way, lights, material)
            i += 1
            joint, within = (i, inside) if reads else (0, False)
            v0, p0, e0, r0, g0, b0 = v1, p1, e1, r1, g1, b1
            last[:] = gradient
            if not alpha > ZERO:
                continue
            counters[1] += 1
            weight = t * alpha
            for k in range(3):
                term[k] = weight * np.float32(color[k])
            term[3] = weight
            for k in range(4):
                part = term[k] + carry[ray, k]
                sum_ = value[ray, k] + part
                carry[ray, k] = part - (sum_ - value[ray, k])
                value[ray, k] = sum_
            t = max((ONE - value[ray, 3]) - carry[ray, 3], ZERO)
            if t <= HALF and depth[ray] == np.float32(np.inf):
                depth[ray] = line[7] + (fi - HALF) * h
            if t < cutoff:
                if renormalise:
                    for k in range(3):
                        value[ray, k] = (value[ray, k] + carry[ray, k]) / (ONE - t)
                    value[ray, 3] = ONE
                    carry[ray, :] = ZERO
                i = end
        cursor[ray, 0], cursor[ray, 2] = i, 2 * joint + (1 if within else 0)
        front[ray, 0] = v0
        for k in range(3):
            front[ray, 1 + k] = last[k]
