"""Find where deflected rays look: what is seen at x is the tissue's at q(x).

Sample ``i`` lies at ``origin + i * step`` in the picture; its place in the volume
follows from that alone. Lengths are those of the straight ray: extinction is pulled
back, a uniform medium stays what it is. Gradients are turned by the map's Jacobian. A
step that crosses a cut's face counts by what of it is in the tissue. Lane after lane in
float64; what it leaves is worked on by all lanes together.
"""

import math

import numpy as np
from numba import njit

from renderers.art.kernels.march_types import (
    F32,
    F64,
    CellView,
    DeflectedSamples,
    Deflectors,
    Lanes,
    Line,
    Three,
)
from renderers.art.kernels.shade_samples import TINY
from renderers.art.kernels.skip import WITHIN, place_samples
from renderers.scene.kernels.deflect import (
    away,
    bend,
    bend_gradient,
    clear_way,
    slope_of_opening,
)
from renderers.simd import i32, load, select, store

SURFACE, POST, INTEGRATED = 0, 1, 2
"""What samples are placed for."""

LARGEST_JUMP = float(1 << 30)
SLACK = 1.0001
"""For rounding in how far what is seen moves."""


@njit(cache=True, nogil=True, error_model="numpy")
def deflected_samples(
    deflectors: Deflectors, kind: int, geometry: F32, spacing: F32, view: CellView,
    width: int,
) -> DeflectedSamples:  # fmt: skip
    """Make memory for a packet."""
    return DeflectedSamples(
        deflectors,
        kind,
        geometry,
        spacing,
        view.top,
        view.leap,
        np.zeros(width, np.int32),
        np.zeros(width, np.float32),
        np.zeros(width, np.int32),
        np.zeros((3, width), np.int32),
        np.zeros((3, width), np.float32),
        np.zeros(width, np.int32),
        np.full(width, np.inf, np.float32),
        np.zeros(width, np.int32),
        np.full((2, width), 0.5, np.float32),
        np.zeros((3, width), np.float32),
        np.zeros((width + 1, len(deflectors.maps), 3)),
        np.zeros((3, 3)),
        np.zeros(1, np.int64),
    )


@njit(cache=True, nogil=True, error_model="numpy")
def _in_tissue(a: float, b: float) -> np.float32:
    """Return how much of half a step, .5 at most, is in no gap, from its openings."""
    if min(a, b) >= 0.0:
        return np.float32(0.5)
    top = max(a, b)
    if top < 0.0:
        return np.float32(0.0)
    # beyond a ball's rim there is no face to be near: half of that half
    if np.isinf(top):
        return np.float32(0.25)
    return np.float32(0.5 * top / (top - min(a, b)))


@njit(cache=True, nogil=True, error_model="numpy")
def _opening_at(
    maps: F64, line: F32, at: float, spacing: F32, point: F64, trail: F64
) -> float:
    """Return the opening of cuts at sample `at` of a ray. line: its geometry."""
    for k in range(3):
        point[k] = (line[k] + at * line[3 + k]) * spacing[k]
    return float(bend(maps, point, trail))


@njit(cache=True, nogil=True, error_model="numpy")
def _opening_beside(
    maps: F64, eye: F64, line: F32, mm: float, spacing: F32, point: F64, trail: F64
) -> float:
    """Return the opening of cuts some mm along a ray from a place on it."""
    for k in range(3):
        point[k] = eye[k] + mm * (line[3 + k] * spacing[k] / max(line[6], TINY))
    return float(bend(maps, point, trail))


@njit(cache=True, nogil=True, error_model="numpy")
def find_samples(samples: DeflectedSamples) -> None:
    """Find where lanes' samples are seen, how far to leap, and what cuts part."""
    maps, stretch, has_cut = samples.deflectors
    kind, geometry, spacing = samples.kind, samples.geometry, samples.spacing
    top, leap = samples.top, samples.leap
    eye, point, aside = samples.points[0], samples.points[1], samples.points[2]
    other = samples.trail[len(samples.on)]
    narrow = float(spacing.min())
    wide, high = int(top[0]) + 1, int(top[1]) + 1
    for lane in range(len(samples.on)):
        if samples.on[lane] == 0:
            continue
        samples.found[0] += 1
        line, at = geometry[samples.ray[lane]], samples.at[lane]
        h = line[6]
        for k in range(3):
            eye[k] = (line[k] + at * line[3 + k]) * spacing[k]
            point[k] = eye[k]
        opening = bend(maps, point, samples.trail[lane])
        samples.opening[lane] = opening
        off, number = 0.0, 0
        for axis in range(3):
            k = 2 - axis
            place = min(max(float(point[k] / spacing[k]), 0.0), float(top[k]) + 1.0)
            cube = min(int(place), int(top[k]))
            off = max(off, abs(place - (cube + 0.5)))
            samples.cube[k, lane] = cube
            samples.part[k, lane] = np.float32(place - cube)
            number = number * (high if k == 1 else wide) + cube
        far = int(leap[number])
        reach = max(float(far) - float(WITHIN) - float(off), 0.0)
        jump = reach / (stretch * h / narrow * SLACK)
        near_cut = False
        if kind == SURFACE:
            if opening < 0.0:
                # in a gap what is seen says nothing of what comes after it
                jump = max(clear_way(-1.0, opening, stretch) / h, 1.0) - 1.0
        elif has_cut:
            distance = away(maps, eye)
            jump = min(jump, distance / h)
            near_cut = distance <= 2.0 * h
        samples.jump[lane] = int(min(jump, LARGEST_JUMP)) + 1
        samples.parted[lane] = 0
        samples.tissue[0, lane] = samples.tissue[1, lane] = np.float32(0.5)
        if not near_cut:
            continue
        before, after = opening, opening
        if kind == POST and far == 0 and opening < h:
            before = _opening_beside(maps, eye, line, -0.5 * h, spacing, aside, other)
            after = _opening_beside(maps, eye, line, 0.5 * h, spacing, aside, other)
            samples.parted[lane] = 1
        elif kind == INTEGRATED and at > 0:
            before = _opening_at(maps, line, at - 1.0, spacing, aside, other)
            # what is seen may jump from one end of the segment to the other
            if min(before, opening) > stretch * h * SLACK:
                continue
            samples.parted[lane] = 1
            opening = _opening_at(maps, line, at - 0.5, spacing, aside, other)
        samples.tissue[0, lane] = _in_tissue(before, opening)
        samples.tissue[1, lane] = _in_tissue(opening, after)


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def place(
    deflected: bool, width: int, at: Lanes, on: Lanes, line: Line, top: Three,
    samples: DeflectedSamples,
) -> Line:  # fmt: skip
    """Return the cubes that samples `at` of rays are seen in, and how far in.

    deflected: whether rays are. Then only lanes `on` are looked up, and the others keep
    what they have. line: origins and steps. top: of `CellView`.
    """
    if deflected:
        store(samples.at, 0, at)
        store(samples.on, 0, select(on, 1, i32(at) * 0))
        find_samples(samples)
        return (
            load(samples.cube, 0, width),
            load(samples.cube, width, width),
            load(samples.cube, 2 * width, width),
            load(samples.part, 0, width),
            load(samples.part, width, width),
            load(samples.part, 2 * width, width),
        )
    return place_samples(at, line, top)


@njit(cache=True, nogil=True, error_model="numpy")
def _turn_gradients(samples: DeflectedSamples) -> None:
    """Turn the gradients of lanes that are on by the Jacobian, where they are seen."""
    gradient = samples.points[0]
    for lane in range(len(samples.on)):
        if samples.on[lane] == 0:
            continue
        for k in range(3):
            gradient[k] = samples.gradient[k, lane]
        bend_gradient(samples.deflectors.maps, samples.trail[lane], gradient)
        for k in range(3):
            samples.gradient[k, lane] = gradient[k]


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def turn(
    deflected: bool, width: int, x: Lanes, y: Lanes, z: Lanes, at: Lanes, none: Lanes,
    samples: DeflectedSamples,
) -> Three:  # fmt: skip
    """Return gradients as they are seen if rays are deflected. none: int32 zeros."""
    if deflected:
        store(samples.on, 0, select(at, 1, none))
        store(samples.gradient, 0, x)
        store(samples.gradient, width, y)
        store(samples.gradient, 2 * width, z)
        _turn_gradients(samples)
        return (
            load(samples.gradient, 0, width),
            load(samples.gradient, width, width),
            load(samples.gradient, 2 * width, width),
        )
    return x, y, z


@njit(cache=True, nogil=True, error_model="numpy")
def turn_into_normals(value: F32, samples: DeflectedSamples) -> None:
    """Turn gradients into normals towards air; on the face of a cut into its own.

    value: float32 (width,), the distances that are seen.
    """
    eye, gradient, aside = samples.points[0], samples.points[1], samples.points[2]
    other, maps = samples.trail[len(samples.on)], samples.deflectors.maps
    for lane in range(len(samples.on)):
        if samples.on[lane] == 0:
            continue
        for k in range(3):
            gradient[k] = samples.gradient[k, lane]
        bend_gradient(maps, samples.trail[lane], gradient)
        if samples.opening[lane] < value[lane]:
            line, at = samples.geometry[samples.ray[lane]], samples.at[lane]
            for k in range(3):
                eye[k] = (line[k] + at * line[3 + k]) * samples.spacing[k]
            slope_of_opening(maps, eye, aside, other, gradient)
        steep = math.sqrt(np.sum(gradient * gradient))
        for k in range(3):
            unit = -gradient[k] / steep if steep > 0.0 else 0.0
            samples.gradient[k, lane] = unit
