"""Bars before a wall: rims that discs stand over."""

import numpy as np
import pytest

from renderers.scene import Camera, Volume


def room() -> Volume:
    """A room of 14 mm with two bars across it, before a wall."""
    n, spacing = 61, 0.3
    k = (np.arange(n) - n // 2) * spacing
    z, y, x = np.meshgrid(k, k, k, indexing="ij")
    wall = np.max(np.abs([x, y, z]), axis=0) - 7.5
    one = 0.8 - np.hypot(y - 0.3 * x - 1.0, z + 1.2)
    other = 0.5 - np.hypot(y + 1.1, x - 1.7 - 0.2 * z)
    distance = np.maximum(np.maximum(wall, one), other).astype(np.float32)
    origin = np.full(3, -(n // 2) * spacing)
    return Volume(distance, np.full(3, spacing), origin, background=1.0)


@pytest.fixture(scope="module")
def bars() -> Volume:
    return room()


@pytest.fixture(scope="module")
def camera() -> Camera:
    return Camera.looking_at([-0.5, -6, 0.3], [0.3, 5, 0], size=(160, 160))
