"""Best rigid motion between paired points.

The least-squares rotation is Kabsch's, from the singular value decomposition of the
3 x 3 covariance (W. Kabsch, Acta Cryst. A32, 1976); Horn's quaternion solution (1987)
is the same rotation, also with weights. The determinant is forced to the wanted sign.
"""

from itertools import permutations

import numpy as np
from numpy.typing import NDArray


def fit_rigid(
    source: NDArray[np.float64],
    target: NDArray[np.float64],
    weights: NDArray[np.float64],
    *,
    mirror: bool = False,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the best target_from_source (..., 4, 4) and its residuals (..., n).

    Points are (..., n, 3); weights (n,) are positive, in any unit. ``mirror`` fits a
    motion with a reflection instead.
    """
    share = weights / weights.sum()
    source_mean = (share[:, None] * source).sum(axis=-2, keepdims=True)
    target_mean = (share[:, None] * target).sum(axis=-2, keepdims=True)
    weighted = np.swapaxes(share[:, None] * (target - target_mean), -1, -2)
    u, _, vt = np.linalg.svd(weighted @ (source - source_mean))
    # The smallest singular direction is the cheapest to turn round when the
    # unconstrained optimum has the other handedness.
    wanted = -1.0 if mirror else 1.0
    turn = np.ones(u.shape[:-1])
    turn[..., 2] = wanted * np.sign(np.linalg.det(u) * np.linalg.det(vt))
    rotation = (u * turn[..., None, :]) @ vt
    back = np.swapaxes(rotation, -1, -2)
    transform = np.zeros((*rotation.shape[:-2], 4, 4))
    transform[..., :3, :3] = rotation
    transform[..., :3, 3] = (target_mean - source_mean @ back)[..., 0, :]
    transform[..., 3, 3] = 1.0
    registered = source @ back + transform[..., None, :3, 3]
    return transform, np.linalg.norm(registered - target, axis=-1)


def rms(residuals: NDArray[np.float64]) -> float:
    """Return the root mean square of residuals of any shape."""
    return float(np.sqrt(np.mean(residuals**2)))


def best_other_order(
    source: NDArray[np.float64],
    target: NDArray[np.float64],
    weights: NDArray[np.float64],
    explained: float,
) -> tuple[int, ...] | None:
    """Return the order of ``source`` with the fewest moved points that fits.

    It fits when the rms residual is below ``explained``; the given order is not among
    those tried. None when no other order does.
    """
    orders = _other_orders(len(source))
    fits = _order_residuals(source, target, weights, orders) < explained
    return tuple(orders[int(np.argmax(fits))].tolist()) if fits.any() else None


def closest_other_order(points: NDArray[np.float64]) -> tuple[tuple[int, ...], float]:
    """Return the exchange that ``points`` (n, 3) hide best, and its rms residual.

    A set that a rotation maps onto itself in another order gives 0: touched in that
    order nobody could tell.
    """
    orders = _other_orders(len(points))
    residual = _order_residuals(points, points, np.ones(len(points)), orders)
    best = int(np.argmin(residual))
    return tuple(orders[best].tolist()), float(residual[best])


def _other_orders(count: int) -> NDArray[np.intp]:
    """Return every order but the given one, those with the fewest moves first."""
    orders = np.array(list(permutations(range(count))), dtype=np.intp)[1:]
    moved = (orders != np.arange(count)).sum(axis=1)
    sorted_orders: NDArray[np.intp] = orders[np.argsort(moved, kind="stable")]
    return sorted_orders


def _order_residuals(
    source: NDArray[np.float64],
    target: NDArray[np.float64],
    weights: NDArray[np.float64],
    orders: NDArray[np.intp],
) -> NDArray[np.float64]:
    residuals = fit_rigid(source[orders], target, weights)[1]
    found: NDArray[np.float64] = np.sqrt(np.mean(residuals**2, axis=-1))
    return found
