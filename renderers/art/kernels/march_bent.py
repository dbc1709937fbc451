"""March rays that deflectors bend: what is seen at x is the tissue's at q(x).

As `renderers.art.kernels.march_packets`, with the same arrays and the same ways to stop
and go on; one ray after the other. Sample ``i`` lies at ``origin + i * step`` in the
picture whatever was skipped before it; its place in the volume follows from that alone.
Lengths are those of the straight ray: extinction is pulled back, a uniform medium stays
what it is. Gradients are turned by the map's Jacobian.
"""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.art.cells.brick_views import CellView, Classification
from renderers.art.kernels.bent_samples import (
    U,
    classify,
    light_sample,
    opacity,
    outside,
    trilinear,
)
from renderers.art.kernels.opacity import HALF, ONE, ZERO
from renderers.art.kernels.shade_samples import TINY
from renderers.art.kernels.skip import WITHIN
from renderers.scene.kernels.deflect import (
    away,
    bend,
    bend_gradient,
    clear_way,
    slope_of_opening,
)

BISECTIONS = 12
"""Halvings of the step around a surface: then it is a fifth of a micrometre wide."""

MISSING, EMPTY = -2, -1

F32 = NDArray[np.float32]
F64 = NDArray[np.float64]


@njit(cache=True, nogil=True, error_model="numpy")
def place(
    maps: F64, x: np.float32, y: np.float32, z: np.float32,
    spacing: F32, top: NDArray[np.int32], point: F64, trail: F64,
) -> float:  # fmt: skip
    """Find which voxel coordinates are seen at some; give the opening of cuts.

    point: (3,), becomes the coordinates seen, within the volume.
    """
    point[0], point[1], point[2] = x * spacing[0], y * spacing[1], z * spacing[2]
    opening = bend(maps, point, trail)
    for k in range(3):
        at = float(point[k] / spacing[k])
        point[k] = min(max(at, 0.0), float(top[k]) + 1.0)
    return opening


@njit(cache=True, nogil=True, error_model="numpy")
def leap_bent(
    maps: F64, point: F64, eye: F64, far: int, cube: NDArray[np.int64],
    per_sample: float, has_cut: bool, h: float, left: int,
) -> int:  # fmt: skip
    """Count the samples that surely see empty space, this one among them.

    point: voxel coordinates seen. eye: where, in mm. far: distance to the next cube
    with something in it, from `cube`. per_sample: voxels that what is seen moves at
    most from sample to sample. A cut lets it jump: inside its ball each sample is
    looked at.
    """
    off = 0.0
    for k in range(3):
        off = max(off, abs(point[k] - (cube[k] + 0.5)))
    reach = max(float(far) - float(WITHIN) - float(off), 0.0)
    jump = reach / per_sample
    if has_cut:
        jump = min(jump, away(maps, eye) / h)
    return int(min(jump, float(left - 1))) + 1


@njit(cache=True, nogil=True, error_model="numpy")
def find_cube(view: CellView, point: F64, cube: NDArray[np.int64]) -> int:
    """Find the cube of a place, and how many cubes on the next with something in it is.

    cube: (3,), becomes the cube.
    """
    for k in range(3):
        cube[k] = min(int(point[k]), int(view.top[k]))
    wide, high = int(view.top[0]) + 1, int(view.top[1]) + 1
    return int(view.leap[U((cube[2] * high + cube[1]) * wide + cube[0])])


@njit(cache=True, nogil=True, error_model="numpy")
def find_corner(
    view: CellView, shift: int, cube: NDArray[np.int64], clock: int,
    missing: NDArray[np.int64],
) -> int:  # fmt: skip
    """Find the first number of a cube's lowest corner; MISSING without one.

    missing: (1,), becomes the cell that is.
    """
    each = view.channels
    ix, iy, iz = int(cube[0]), int(cube[1]), int(cube[2])
    cell = (iz >> shift) * int(view.counts[1]) + (iy >> shift)
    cell = cell * int(view.counts[0]) + (ix >> shift)
    slot = int(view.slots[cell])
    if slot < 0:
        missing[0] = cell
        return MISSING
    if clock > 0:
        view.stamp[slot] = clock
    mask, n1 = (1 << shift) - 1, (1 << shift) + 1
    lx, ly, lz = ix & mask, iy & mask, iz & mask
    return (((slot * n1 + lz) * n1 + ly) * n1 + lx) * each


@njit(cache=True, nogil=True, error_model="numpy")
def find_samples(
    view: CellView, shift: int, point: F64, cube: NDArray[np.int64], clock: int,
    current: NDArray[np.int64],
) -> int:  # fmt: skip
    """Find the first number of a cube's lowest corner; MISSING or EMPTY without one.

    cube: (3,), becomes the cube. current: (1,), becomes the cell that is missing, or
    the distance to the next cube with something in it.
    """
    far = find_cube(view, point, cube)
    if far > 0:
        current[0] = far
        return EMPTY
    return find_corner(view, shift, cube, clock, current)


@njit(cache=True, nogil=True, error_model="numpy")
def march_classic(
    maps: F64, stretch: float, has_cut: bool,
    order: NDArray[np.int32], geometry: F32, count: NDArray[np.int32],
    cursor: NDArray[np.int32], value: F32, carry: F32, depth: F32,
    view: CellView, shift: int, clock: int, table: Classification,
    lights: F32, material: F32, spacing: F32,
    least_gradient: np.float32, cutoff: np.float32, renormalise: bool,
    counters: NDArray[np.int64],
) -> None:  # fmt: skip
    """Composite each bent ray until it ends, is opaque, or misses a cell.

    maps: see `renderers.scene.deflection.maps`. stretch: mm that what is seen moves at
    most for a mm of the ray. counters: int64 samples, contributing, skipped, bent. A
    step that crosses a cut's face counts by the share of it that is in the tissue.
    """
    each = view.channels
    row = each * ((1 << shift) + 1)
    slab = row * ((1 << shift) + 1)
    point, eye, way, end_point = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    trail, other = np.empty((len(maps), 3)), np.empty((len(maps), 3))
    cube, note = np.empty(3, np.int64), np.empty(1, np.int64)
    gradient, color = np.empty(3), np.empty(3)
    term = np.empty(4, np.float32)
    narrow = float(spacing.min())
    for ray in order:
        cursor[ray, 3] = 0
        i, end = int(cursor[ray, 0]), int(count[ray])
        h = geometry[ray, 6]
        per_sample = stretch * h / narrow * 1.0001
        for k in range(3):
            way[k] = geometry[ray, 3 + k] * spacing[k] / max(h, TINY)
        t = max((ONE - value[ray, 3]) - carry[ray, 3], ZERO)
        while i < end:
            fi = np.float32(i)
            x = geometry[ray, 0] + fi * geometry[ray, 3]
            y = geometry[ray, 1] + fi * geometry[ray, 4]
            z = geometry[ray, 2] + fi * geometry[ray, 5]
            opening = place(maps, x, y, z, spacing, view.top, point, trail)
            eye[0], eye[1], eye[2] = x * spacing[0], y * spacing[1], z * spacing[2]
            counters[3] += 1
            at = find_samples(view, shift, point, cube, clock, note)
            if at == MISSING:
                cursor[ray, 3] = note[0] + 1
                break
            if at == EMPTY:
                jump = leap_bent(
                    maps, point, eye, note[0], cube, per_sample, has_cut, h, end - i
                )
                counters[2] += jump
                i += jump
                continue
            i += 1
            counters[0] += 1
            share = ONE
            if opening < h:
                for k in range(3):
                    end_point[k] = eye[k] - 0.5 * h * way[k]
                before = bend(maps, end_point, other)
                for k in range(3):
                    end_point[k] = eye[k] + 0.5 * h * way[k]
                share = outside(before, opening, bend(maps, end_point, other))
            fx = np.float32(point[0] - cube[0])
            fy = np.float32(point[1] - cube[1])
            fz = np.float32(point[2] - cube[2])
            v = trilinear(view.samples, at, each, row, slab, fx, fy, fz) * view.unit
            kappa, color[0], color[1], color[2] = classify(table, v)
            kappa *= share
            if kappa <= ZERO:
                continue
            counters[1] += 1
            if each > 1:
                for k in range(3):
                    gradient[k] = trilinear(
                        view.samples, at + 1 + k, each, row, slab, fx, fy, fz
                    )
                bend_gradient(maps, trail, gradient)
                steep = math.sqrt(np.sum(gradient * gradient))
                if steep > least_gradient:
                    gradient /= -steep
                    light_sample(gradient, eye, way, lights, material, color)
            weight = t * opacity(kappa * h)
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
                depth[ray] = geometry[ray, 7] + fi * h
            if t < cutoff:
                if renormalise:
                    for k in range(3):
                        value[ray, k] = (value[ray, k] + carry[ray, k]) / (ONE - t)
                    value[ray, 3] = ONE
                    carry[ray, :] = ZERO
                i = end
        cursor[ray, 0] = i


@njit(cache=True, nogil=True, error_model="numpy")
def march_scope(
    maps: F64, stretch: float,
    order: NDArray[np.int32], geometry: F32, count: NDArray[np.int32],
    cursor: NDArray[np.int32], value: F32, depth: F32,
    view: CellView, shift: int, clock: int, spacing: F32,
    counters: NDArray[np.int64],
) -> None:  # fmt: skip
    """Find where each bent ray first meets tissue; write its depth and normal there.

    Tissue is where the distance seen is not negative and no cut gapes. Stages of
    cursor: 0 leaps and samples, 1 to BISECTIONS halve the step before the first sample
    in tissue, then the normal is read at the bracket's far end.
    """
    row = 4 * ((1 << shift) + 1)
    slab = row * ((1 << shift) + 1)
    point, eye = np.empty(3), np.empty(3)
    trail, other = np.empty((len(maps), 3)), np.empty((len(maps), 3))
    cube, note = np.empty(3, np.int64), np.empty(1, np.int64)
    gradient, beside = np.empty(3), np.empty(3)
    narrow = float(spacing.min())
    for ray in order:
        cursor[ray, 3] = 0
        i, stage, bracket = int(cursor[ray, 0]), cursor[ray, 1], cursor[ray, 2]
        end = int(count[ray])
        h = geometry[ray, 6]
        per_sample = stretch * h / narrow * 1.0001
        while i < end:
            at_i = np.float32(i)
            if stage > BISECTIONS and i > 0:
                at_i = np.float32(i - 1 + (bracket + 1) / (1 << BISECTIONS))
            elif stage > 0 and i > 0:
                at_i = np.float32(i - 1 + (2 * bracket + 1) / (1 << stage))
            x = geometry[ray, 0] + at_i * geometry[ray, 3]
            y = geometry[ray, 1] + at_i * geometry[ray, 4]
            z = geometry[ray, 2] + at_i * geometry[ray, 5]
            opening = place(maps, x, y, z, spacing, view.top, point, trail)
            eye[0], eye[1], eye[2] = x * spacing[0], y * spacing[1], z * spacing[2]
            counters[3] += 1
            at = find_samples(view, shift, point, cube, clock, note)
            if at == MISSING:
                cursor[ray, 3] = note[0] + 1
                break
            v = -ONE
            if at == EMPTY:
                if stage == 0:
                    if opening < 0.0:
                        # in a gap what is seen says nothing of what comes after it
                        clear = clear_way(-1.0, opening, stretch)
                        jump = max(min(int(clear / h), end - i), 1)
                    else:
                        jump = leap_bent(
                            maps, point, eye, note[0], cube, per_sample, False, h,
                            end - i,
                        )  # fmt: skip
                    counters[2] += jump
                    i += jump
                    continue
                if stage > BISECTIONS:
                    # rounding of the last bracket: the surface is at its end
                    at = 0
            else:
                counters[0] += 1
            fx = np.float32(point[0] - cube[0])
            fy = np.float32(point[1] - cube[1])
            fz = np.float32(point[2] - cube[2])
            if at >= 0:
                v = trilinear(view.samples, at, 4, row, slab, fx, fy, fz)
            if stage > BISECTIONS:
                for k in range(3):
                    gradient[k] = trilinear(
                        view.samples, at + 1 + k, 4, row, slab, fx, fy, fz
                    )
                bend_gradient(maps, trail, gradient)
                if opening < v:
                    # the face of a cut
                    slope_of_opening(maps, eye, beside, other, gradient)
                steep = math.sqrt(np.sum(gradient * gradient))
                for k in range(3):
                    unit = -gradient[k] / steep if steep > 0.0 else 0.0
                    value[ray, k] = np.float32(unit)
                value[ray, 3] = ONE
                depth[ray] = geometry[ray, 7] + at_i * h
                counters[1] += 1
                i = end
                continue
            v = np.float32(min(float(v), float(opening)))
            if stage > 0:
                bracket = 2 * bracket + (1 if v < ZERO else 0)
                stage += 1
            elif v < ZERO:
                i += 1
            else:
                # at sample 0 the eye, or the volume's face, is in tissue
                stage = 1 if i > 0 else BISECTIONS + 1
                bracket = 0
        cursor[ray, 0], cursor[ray, 1], cursor[ray, 2] = i, stage, bracket
