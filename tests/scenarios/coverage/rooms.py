"""Rooms of air of closed form, for what can be seen in them."""

import numpy as np

from renderers.scene import Volume


def sphere_room(radius_mm: float = 10.0, spacing_mm: float = 0.5) -> Volume:
    """Return the distance field of a ball of air about the origin."""
    x, y, z = _grid(radius_mm + 3.0, spacing_mm)
    return _volume(np.sqrt(x**2 + y**2 + z**2) - radius_mm, spacing_mm)


def walled_room(radius_mm: float = 10.0, spacing_mm: float = 0.5) -> Volume:
    """Return the ball with a wall in it: 4.3 < y < 6.3 for x < 6."""
    x, y, z = _grid(radius_mm + 3.0, spacing_mm)
    ball = np.sqrt(x**2 + y**2 + z**2) - radius_mm
    wall = np.maximum(np.abs(y - 5.3) - 1.0, x - 6.0)
    return _volume(np.maximum(ball, -wall), spacing_mm)


def lopsided_room(spacing_mm: float = 0.5) -> tuple[Volume, Volume]:
    """Return two balls that meet, and their mirror image in x."""
    x, y, z = _grid(12.0, spacing_mm)

    def air(x: np.ndarray) -> np.ndarray:
        first = np.sqrt((x + 3) ** 2 + y**2 + z**2) - 7.0
        second = np.sqrt((x - 4) ** 2 + (y + 3) ** 2 + (z - 1) ** 2) - 4.0
        both: np.ndarray = np.minimum(first, second)
        return both

    return _volume(air(x), spacing_mm), _volume(air(-x), spacing_mm)


def _grid(half_mm: float, spacing_mm: float) -> tuple[np.ndarray, ...]:
    count = 2 * round(half_mm / spacing_mm)
    # an even number of voxels: blocks of two lie alike in the mirror
    axis = spacing_mm * (np.arange(count) - (count - 1) / 2)
    z, y, x = np.meshgrid(axis, axis, axis, indexing="ij")
    return x, y, z


def _volume(values: np.ndarray, spacing_mm: float) -> Volume:
    origin = -spacing_mm * (values.shape[0] - 1) / 2
    return Volume(
        values.astype(np.float32),
        np.full(3, spacing_mm),
        np.full(3, origin),
        background=10.0,
    )
