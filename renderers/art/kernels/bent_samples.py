"""Compiled: what one sample of a bent ray is worth."""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.art.cells.brick_views import Classification
from renderers.art.kernels.interpolate_scalar import U
from renderers.art.kernels.opacity_scalar import ONE, ZERO, power

F32 = NDArray[np.float32]
F64 = NDArray[np.float64]


@njit(cache=True, nogil=True, error_model="numpy")
def classify(
    table: Classification, v: np.float32
) -> tuple[np.float32, np.float32, np.float32, np.float32]:
    """Give extinction, red, green, blue of a density."""
    at = min(max((v - table.low) * table.scale + ONE, ZERO), table.last)
    f = at - np.float32(int(at))
    line = table.lines[U(int(at))]
    if line[0] + f * line[1] >= ZERO:
        return (
            line[0] + f * line[1],
            line[2] + f * line[3],
            line[4] + f * line[5],
            line[6] + f * line[7],
        )
    k = table.first[int(at)]
    while v >= table.extinction[k, 1]:
        k += 1
    dv = max(v - table.extinction[k, 0], ZERO)
    color, slope = table.color[k], table.color_slope[k]
    return (
        table.extinction[k, 2] + dv * table.extinction[k, 3],
        color[0] + dv * slope[0],
        color[1] + dv * slope[1],
        color[2] + dv * slope[2],
    )


@njit(cache=True, nogil=True, error_model="numpy")
def light_sample(
    normal: F64, at: F64, way: F64, lights: F32, material: F32, color: F64
) -> None:
    """Light a sample's colour, in place; at: mm, way: the ray's unit direction."""
    given, glint = np.full(3, float(material[0])), np.zeros(3)
    to_light, half = np.empty(3), np.empty(3)
    for m in range(len(lights)):
        length = 0.0
        for k in range(3):
            to_light[k] = lights[m, k]
            if lights[m, 9] > ZERO:
                to_light[k] -= at[k]
            length += to_light[k] * to_light[k]
        if lights[m, 9] > ZERO:
            to_light /= max(math.sqrt(length), 1e-6)
        facing = max(np.sum(normal * to_light), 0.0)
        for k in range(3):
            given[k] += facing * lights[m, 3 + k]
        if material[1] > ZERO:
            half[:] = to_light - way
            width = max(math.sqrt(np.sum(half * half)), 1e-6)
            facing = max(np.sum(normal * half) / width, 0.0)
            shine = power(np.float32(facing), material[2])
            for k in range(3):
                glint[k] += shine * lights[m, 6 + k]
    for k in range(3):
        color[k] = color[k] * given[k] + glint[k]


@njit(cache=True, nogil=True, error_model="numpy")
def half_outside(a: float, b: float) -> np.float32:
    """Give how much of half a step, .5 at most, is not in a gap, from its openings."""
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
def outside(before: float, middle: float, after: float) -> np.float32:
    """Give the share of a step that is not in a gap, from openings at three places."""
    return half_outside(before, middle) + half_outside(middle, after)
