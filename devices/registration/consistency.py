"""Whether the residual of a fit is what the error model expects.

The residual r of a fit of p unknowns to N numbers, whose errors have the covariance S,
gives T = r^T M r with M = S^-1 - S^-1 J (J^T S^-1 J)^-1 J^T S^-1, J the numbers' change
with the unknowns. T does not depend on the weights of the fit and is chi-square
distributed with N - p degrees of freedom when the model holds. A larger T tells that
something is worse than the model knows. The square root of T / (N - p), the ratio of
Birge (Phys. Rev. 40, 1932), then says by how much errors are understated.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc

from devices.registration.target_error import PointErrors, moves

# One sound registration in a thousand is refused.
REFUSED_CHANCE = 1e-3

# One sound registration in twenty tells a larger error than it has.
DOUBTED_CHANCE = 0.05


@dataclass(frozen=True, slots=True)
class Consistency:
    """A chi-square statistic and its degrees of freedom."""

    statistic: float
    freedom: int

    @property
    def chance(self) -> float:
        """Return the probability of so large a residual when the model holds."""
        if self.freedom < 1:
            return 1.0
        return float(chdtrc(self.freedom, self.statistic))

    @property
    def ratio(self) -> float:
        """Return how much larger errors are than the model's; 1 where it may hold."""
        if self.chance >= DOUBTED_CHANCE:
            return 1.0
        return max(1.0, float(np.sqrt(self.statistic / self.freedom)))


@dataclass(frozen=True, slots=True)
class LandmarkConsistency:
    """Whether touched points are as far off their places as they may be."""

    whole: Consistency
    without: tuple[Consistency, ...]
    """The same when nothing is known of one point, for each of the points."""

    @property
    def culprit(self) -> int | None:
        """Return the one point without which the rest agrees, None for none."""
        best = min(
            range(len(self.without)), key=lambda i: self.without[i].statistic, default=0
        )
        if not self.without or self.without[best].freedom < 1:
            return None
        return best if self.without[best].chance >= DOUBTED_CHANCE else None


def landmark_consistency(
    points: NDArray[np.float64], missing: NDArray[np.float64], errors: PointErrors
) -> LandmarkConsistency:
    """Judge the residual vectors ``missing`` (n, 3) of rigidly fitted points (n, 3).

    Patient's frame, mm. ``errors`` are those that the points are expected to have.
    """
    count = len(points)
    rows = moves(points, points.mean(axis=0)).reshape(3 * count, 6)
    off = missing.reshape(-1)
    common = errors.common.reshape(3 * count, -1)
    covariance = common @ common.T
    for i in range(count):
        block = slice(3 * i, 3 * i + 3)
        covariance[block, block] += errors.noise[i]
    inverse = np.linalg.inv(covariance)
    pulled = inverse @ rows
    judged = inverse - pulled @ np.linalg.solve(rows.T @ pulled, pulled.T)
    whole = Consistency(float(off @ judged @ off), 3 * count - 6)
    without = []
    for i in range(count):
        # Three more unknowns, the shift of one point, leave this much less.
        block = slice(3 * i, 3 * i + 3)
        pull = (judged @ off)[block]
        held = judged[block, block]
        # Where the others leave the point free nothing is explained by it.
        explained = float(pull @ np.linalg.lstsq(held, pull, rcond=1e-9)[0])
        rank = int(np.linalg.matrix_rank(held, tol=1e-9 * float(np.trace(inverse))))
        without.append(
            Consistency(max(whole.statistic - explained, 0.0), whole.freedom - rank)
        )
    return LandmarkConsistency(whole, tuple(without))
