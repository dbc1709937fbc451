"""Compiled: sample a picture's light, and the gain that gives it a mean."""

import numpy as np
from numba import njit

from renderers.simd.arrays import Floats, Ints, f32


@njit(cache=True, nogil=True, error_model="numpy")
def sample_light(
    radiance: Floats,
    rows: Ints,
    columns: Ints,
    luminance: Floats,
    largest: Floats,
) -> None:
    """Give the luminance and the largest channel of the listed pixels."""
    for i in range(rows.shape[0]):
        r, g, b = radiance[rows[i], columns[i]]
        luminance[i] = f32(0.2126) * r + f32(0.7152) * g + f32(0.0722) * b
        largest[i] = max(r, max(g, b))


@njit(cache=True, nogil=True, error_model="numpy")
def count_within(values: Floats, factor: np.float32, most: np.float32) -> int:
    """Count the values that times a factor do not exceed `most`."""
    count = 0
    for i in range(values.shape[0]):
        count += values[i] * factor <= most
    return count


@njit(cache=True, nogil=True, error_model="numpy")
def find_gain(
    luminance: Floats, weight: Floats, target: float, most: float, rounds: int
) -> float:
    """Find the gain g that brings the weighted mean of min(g Y, 1) to `target`.

    The mean is piecewise linear and concave in g, so that Newton's method from below
    rises to the solution and stops there; `most` where there is none below it.
    """
    gain = 0.0
    for _ in range(rounds):
        clipped = 0.0
        slope = 0.0
        for i in range(luminance.shape[0]):
            y = float(luminance[i])
            w = float(weight[i])
            if gain * y < 1.0:
                slope += w * y
            else:
                clipped += w
        if not slope * most > target - clipped:
            return most
        better = (target - clipped) / slope
        if better <= gain * (1.0 + 1e-9):
            break
        gain = better
    return gain
