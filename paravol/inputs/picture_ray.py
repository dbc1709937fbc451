"""A place of the scope's picture as a ray, and where tissue begins on it."""

import math

import numpy as np
from numpy.typing import NDArray

from renderers.scene import Camera, Volume

Doubles = NDArray[np.float64]

FARTHEST_MM = 60.0
"""Farther ahead nothing is looked for, and no tool's tip goes."""

STEP_MM = 0.2
"""Shortest step on the way along a ray to tissue."""


def ray_of(camera: Camera, at: tuple[float, float]) -> Doubles:
    """Return the unit direction, ``(3,)``, of a place in a round picture.

    at: right and up from the middle, 1 at the rim; what lies beyond it is at the rim.
    """
    _, right, up, forward = camera.frame
    away = math.hypot(*at)
    if away < 1e-9:
        return np.array(forward)
    angle = min(away, 1.0) * camera.extent
    aside = (at[0] * right + at[1] * up) / away
    found: Doubles = math.cos(angle) * forward + math.sin(angle) * aside
    return found


def reach_mm(distance: Volume, eye_mm: Doubles, along: Doubles) -> float:
    """Return how far ahead along a ray tissue begins, mm; infinite for nowhere near."""
    if not np.all(np.isfinite(eye_mm + along)):
        return math.inf
    matrix = distance.voxel_from_world
    start, way = matrix[:3, :3] @ eye_mm + matrix[:3, 3], matrix[:3, :3] @ along
    at_mm = before_mm = before = 0.0
    while at_mm < FARTHEST_MM:
        here = distance.at_voxel(start + at_mm * way)
        if here >= 0.0:
            if before < 0.0:
                share = before / (before - here)
                at_mm = before_mm + share * (at_mm - before_mm)
            return at_mm
        before_mm, before = at_mm, here
        at_mm += max(-here, STEP_MM)
    return math.inf
