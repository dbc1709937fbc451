"""Threads and fields that several FSR tests share."""

import numpy as np
import pytest

from renderers.scene import Volume
from renderers.scene.thread_pool import ThreadPool
from tests.renderers.fsr.rim_scene import bars, camera

__all__ = ["bars", "camera"]


@pytest.fixture(scope="session")
def pool() -> ThreadPool:
    return ThreadPool(1)


@pytest.fixture(scope="session")
def three() -> ThreadPool:
    return ThreadPool(3)


@pytest.fixture(scope="session")
def hollow() -> Volume:
    """Air inside a sphere of 6 mm around the origin, 0.5 mm voxels."""
    k, j, i = np.indices((33, 33, 33)) * 0.5 - 8.0
    d = np.sqrt(i * i + j * j + k * k) - 6.0
    return Volume(d.astype(np.float32), np.full(3, 0.5), np.full(3, -8.0))


@pytest.fixture(scope="session")
def cavities() -> Volume:
    """Two hollow spheres joined by a hole of 1.2 mm radius in a wall of 1.5 mm."""
    k, j, i = np.indices((33, 33, 61)) * 0.5
    p = np.stack([i - 15.0, j - 8.0, k - 8.0], axis=-1)
    balls = [np.linalg.norm(p - (x, 0, 0), axis=-1) - 5.5 for x in (-6.25, 6.25)]
    hole = np.maximum(np.hypot(p[..., 1], p[..., 2]) - 1.2, np.abs(p[..., 0]) - 3)
    d = np.minimum(np.minimum(balls[0], balls[1]), hole)
    return Volume(d.astype(np.float32), np.full(3, 0.5), np.array([-15.0, -8.0, -8.0]))
