"""A triangle's picture stays within what is said of it."""

import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from renderers.scene import Projection
from renderers.scene.kernels.triangle_bounds import (
    BOXED,
    UNSEEN,
    bound_equidistant,
    bound_plane,
)

SEEDS = st.integers(0, 2**32 - 1)


@given(seed=SEEDS)
def test_a_triangles_picture_stays_within_its_bound(seed: int) -> None:
    """Points of the triangle project into the box, and near the flat picture."""
    rng = np.random.default_rng(seed)
    size = 10 ** rng.uniform(-2, 1.5)
    corners = rng.uniform(-12, 12, 3) + size * rng.normal(size=(3, 3))
    box, at = np.empty(4), np.empty(6)
    widest = rng.uniform(0.3, 1.4)
    bulge = bound_equidistant(corners.ravel(), widest, box, at)
    shares = rng.dirichlet([0.7] * 3, 300)
    shares = np.vstack([shares, np.eye(3)])
    edge = rng.uniform(size=(60, 1))
    for i in range(3):
        shares = np.vstack(
            [shares, edge * np.eye(3)[i] + (1 - edge) * np.eye(3)[i - 1]]
        )
    points = shares @ corners
    sine = np.hypot(points[:, 0], points[:, 1])
    theta = np.arctan2(sine, points[:, 2])
    if bulge == UNSEEN:
        assert theta.min() > widest
        return
    picture = theta[:, None] * points[:, :2] / np.maximum(sine, 1e-300)[:, None]
    inside = theta <= widest
    x, y = picture[inside].T if inside.any() else np.zeros((2, 0))
    assert np.all((x >= box[0] - 1e-9) & (x <= box[1] + 1e-9))
    assert np.all((y >= box[2] - 1e-9) & (y <= box[3] + 1e-9))
    if bulge == BOXED:
        return
    flat = at.reshape(3, 2)
    for p in picture[inside]:
        assert distance_to_triangle(p, flat) <= bulge + 1e-9


def distance_to_triangle(p: NDArray[np.float64], flat: NDArray[np.float64]) -> float:
    """Give 0 inside."""
    turns = []
    nearest = math.inf
    for i in range(3):
        a, b = flat[i], flat[(i + 1) % 3]
        side, to = b - a, p - a
        turns.append(side[0] * to[1] - side[1] * to[0])
        share = np.clip(to @ side / max(side @ side, 1e-300), 0, 1)
        nearest = min(nearest, float(np.linalg.norm(to - share * side)))
    if min(turns) >= 0 or max(turns) <= 0:
        return 0.0
    return nearest


@given(seed=SEEDS)
def test_a_pinholes_triangle_stays_within_its_corners(seed: int) -> None:
    rng = np.random.default_rng(seed)
    corners = rng.uniform(-5, 5, (3, 3)) + rng.uniform(-8, 8) * np.eye(3)[2]
    box, at = np.empty(4), np.empty(6)
    bulge = bound_plane(corners.ravel(), int(Projection.PERSPECTIVE), box, at)
    points = rng.dirichlet([1] * 3, 200) @ corners
    front = points[points[:, 2] > 1e-6]
    if bulge == UNSEEN:
        assert not len(front)
        return
    x, y = front[:, 0] / front[:, 2], front[:, 1] / front[:, 2]
    assert np.all((x >= box[0] - 1e-9) & (x <= box[1] + 1e-9))
    assert np.all((y >= box[2] - 1e-9) & (y <= box[3] + 1e-9))
