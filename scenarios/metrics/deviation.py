"""How far a path lies from an expert's: Hausdorff, discrete Fréchet, time warping."""

from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.distance import cdist

from scenarios.metrics.measured import Measured
from scenarios.metrics.metric import SCOPE, Definition, Found, too_little
from scenarios.metrics.track import Piece

Doubles = NDArray[np.float64]

POINTS = 200
"""Points, evenly spaced along each path, that are compared."""

NO_EXPERT = "there is no expert's session to compare with"


def even_points(pieces: list[Piece], count: int = POINTS) -> Doubles | None:
    """Return points ``(count, 3)`` at even steps of the path; None without a path."""
    if not pieces:
        return None
    ends = np.cumsum([0.0, *(piece.way_mm[-1] for piece in pieces)])
    if not ends[-1] > 0.0:
        return None
    # nothing is known of the way over a gap: it has no length
    ways = [piece.way_mm + begin for piece, begin in zip(pieces, ends, strict=False)]
    way = np.concatenate(ways)
    tips = np.concatenate([piece.tip_mm for piece in pieces])
    at = np.linspace(0.0, ends[-1], count)
    return np.stack([np.interp(at, way, column) for column in tips.T], axis=1)


def hausdorff_mm(one: Doubles, other: Doubles) -> float:
    """Return the largest distance of a point of either path to the other path."""
    away = cdist(one, other)
    return float(max(away.min(axis=0).max(), away.min(axis=1).max()))


def frechet_mm(one: Doubles, other: Doubles) -> float:
    """Return the discrete Fréchet distance: Hausdorff's that keeps the order.

    T. Eiter, H. Mannila: Computing discrete Fréchet distance, TU Wien, 1994.
    """
    return _coupled(cdist(one, other), is_sum=False)


def warped_mm(one: Doubles, other: Doubles) -> float:
    """Return the sum of distances of the best warping in time, a point of the path."""
    return _coupled(cdist(one, other), is_sum=True) / max(len(one), len(other))


def _coupled(away: Doubles, *, is_sum: bool) -> float:
    """Return the least cost of a walk from the first pair to the last one.

    Each step goes on in one path or in both. Along anti-diagonals, whose cells do not
    need one another.
    """
    rows, columns = away.shape
    cost = np.full((rows + 1, columns + 1), np.inf)
    cost[0, 0] = 0.0
    for diagonal in range(rows + columns - 1):
        i = np.arange(max(0, diagonal - columns + 1), min(rows, diagonal + 1))
        j = diagonal - i
        before = np.minimum(cost[i, j + 1], cost[i + 1, j])
        before = np.minimum(before, cost[i, j])
        here = away[i, j]
        cost[i + 1, j + 1] = before + here if is_sum else np.maximum(before, here)
    return float(cost[-1, -1])


def _compared(
    measured: Measured, distance_mm: Callable[[Doubles, Doubles], float]
) -> Found:
    if measured.expert is None:
        return Found(None, (), NO_EXPERT)
    one = even_points(measured.scope_pieces)
    other = even_points(measured.expert.pieces(measured.settings))
    if one is None or other is None:
        return too_little("both sessions need a path")
    return Found(distance_mm(one, other), measured.spans(SCOPE))


DEVIATION = tuple(
    Definition(
        f"{name} distance to expert",
        SCOPE,
        "mm",
        partial(_compared, distance_mm=compute),
        "low-passed",
    )
    for name, compute in (
        ("Hausdorff", hausdorff_mm),
        ("Fréchet", frechet_mm),
        ("time-warped", warped_mm),
    )
)
