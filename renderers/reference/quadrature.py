"""The emission-absorption integral by two-point Gauss steps, from kink to kink.

Along a ray a trilinear density is a cubic between two faces of voxels, and a transfer
function has its own kinks where the density passes one of its nodes. Between them all
is smooth, and two-point Gauss quadrature, as the Runge-Kutta method of fourth order
that it is for optical depth and light together (Hairer, Norsett and Wanner, Solving
Ordinary Differential Equations I, section II.7), has an error of the fourth order.
"""

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

F64 = NDArray[np.float64]

Medium = Callable[[F64], tuple[F64, F64]]
"""Gives colour ``(n, c)`` and extinction per mm ``(n,)`` at distances along a ray."""

_OFF = math.sqrt(3) / 6
_HALVINGS = 60

_CUBIC = np.linalg.inv(np.vander([0.0, 1 / 3, 2 / 3, 1.0]))
"""From values at thirds of an interval to coefficients, highest first."""


def gauss_ray(medium: Medium, cuts: F64) -> tuple[F64, float]:
    """Return the light ``(c,)`` and the transmittance of a ray.

    cuts: increasing distances in mm, at each place where the medium is not smooth and
    as many between as are wanted: the ends of the steps.
    """
    h = np.diff(cuts)
    middle = cuts[:-1] + 0.5 * h
    c1, k1 = medium(middle - _OFF * h)
    c2, k2 = medium(middle + _OFF * h)
    w1 = k1 * np.exp(-h * (0.25 * k1 + (0.25 - _OFF) * k2))
    w2 = k2 * np.exp(-h * ((0.25 + _OFF) * k1 + 0.25 * k2))
    tau = 0.5 * h * (k1 + k2)
    # A mean colour and an exact opacity: an even colour stays what it is.
    weight = np.where(w1 + w2 > 0, w1 + w2, 1.0)
    color = (w1[:, None] * c1 + w2[:, None] * c2) / weight[:, None]
    depth = np.concatenate([[0.0], np.cumsum(tau)])
    light = (np.exp(-depth[:-1]) * -np.expm1(-tau)) @ color
    return light, math.exp(-float(depth[-1]))


def faces(start: F64, rate: F64, near: float, far: float) -> F64:
    """Return where a ray passes from voxel to voxel, and both ends of it.

    start, rate: place in voxels at distance 0, and its change with distance.
    """
    found = [np.array([near, far])]
    for at, per_mm in zip(start, rate, strict=True):
        if abs(per_mm) > 1e-12:
            low, high = sorted((at + near * per_mm, at + far * per_mm))
            steps = np.arange(math.ceil(low), math.floor(high) + 1)
            found.append((steps - at) / per_mm)
    return np.unique(np.clip(np.concatenate(found), near, far))


def kinks(density: Callable[[F64], F64], ends: F64, nodes: F64) -> F64:
    """Return where a density passes a transfer function's nodes, between `ends`.

    density: at distances; a cubic from each of the increasing `ends` to the next, which
    is halved until a root is known to rounding.
    """
    low, width = ends[:-1], np.diff(ends)
    values = np.stack([density(low + width * s / 3) for s in range(4)])
    cubic = _CUBIC @ values
    # From turn to turn it rises or falls only.
    a, b, c = 3 * cubic[0], 2 * cubic[1], cubic[2]
    root = np.sqrt(np.maximum(b * b - 4 * a * c, 0))
    q = -0.5 * (b + np.where(b < 0, -root, root))
    with np.errstate(divide="ignore", invalid="ignore"):
        turns = np.nan_to_num(np.stack([q / a, c / q]), posinf=0.0, neginf=0.0)
    turns = np.sort(np.clip(turns, 0, 1), axis=0)
    parts = np.concatenate([np.zeros((1, len(low))), turns, np.ones((1, len(low)))])
    heights = np.stack([_horner(cubic, s) for s in parts])
    above = heights[..., None] >= nodes
    part, interval, node = np.nonzero(above[:-1] != above[1:])
    left, right = parts[part, interval], parts[part + 1, interval]
    begins = above[part, interval, node]
    for _ in range(_HALVINGS):
        s = 0.5 * (left + right)
        same = (_horner(cubic[:, interval], s) >= nodes[node]) == begins
        left, right = np.where(same, s, left), np.where(same, right, s)
    found: F64 = low[interval] + width[interval] * right
    return found


def steps_between(cuts: F64, step_mm: float) -> F64:
    """Cut intervals into equal steps, none longer than asked for."""
    counts = np.maximum(np.ceil(np.diff(cuts) / step_mm), 1).astype(np.int64)
    number = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    begun = np.repeat(cuts[:-1], counts)
    part = np.repeat(np.diff(cuts) / counts, counts)
    return np.append(begun + number * part, cuts[-1])


def _horner(cubic: F64, s: F64) -> F64:
    result: F64 = ((cubic[0] * s + cubic[1]) * s + cubic[2]) * s + cubic[3]
    return result
