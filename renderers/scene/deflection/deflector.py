"""One place where tissue is moved: a ball, and a weight that fades to its rim."""

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from system import UserError

Points = NDArray[np.float64]

STEEPEST = 8 / (3 * math.sqrt(3))
"""Largest |dw/ds|, at s = 1 / sqrt 3."""

LARGEST_SCALE = 1.25
"""Scaling by 1 + k w folds from this k on: w + s dw/ds is least, -.8, at s^2 = .6."""

SAFETY = 0.95
"""Share of a fold limit that may be used: beyond, tissue is stretched twentyfold."""


class FoldError(UserError):
    """A deflector is so strong that tissue would appear twice."""


def weight(s2: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return w for squared distances from the centre in radii."""
    return np.maximum(1 - s2, 0.0) ** 2


@dataclass(frozen=True, slots=True)
class Deflector(ABC):
    """Move tissue within a ball. center_mm: ``(3,)``. radius_mm: of the ball."""

    center_mm: NDArray[np.float64]
    radius_mm: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "center_mm", finite_vector("center", self.center_mm))
        if not (math.isfinite(self.radius_mm) and self.radius_mm > 0):
            raise UserError(
                f"a deflector's radius must be positive, got {self.radius_mm} mm"
            )

    @abstractmethod
    def pull_back(self, points: Points) -> Points:
        """Return which places of the undeformed tissue are seen at places x."""

    @abstractmethod
    def push_forward(self, points: Points) -> Points:
        """Return where places of the undeformed tissue are seen: the inverse."""

    @abstractmethod
    def jacobian(self, points: Points) -> NDArray[np.float64]:
        """Return dq/dx at places x, ``(n, 3, 3)``."""

    @property
    @abstractmethod
    def stretch(self) -> float:
        """Return a bound on how far q moves for a mm of x: of the Jacobian's norm."""

    def opening(self, points: Points) -> NDArray[np.float64]:
        """Return how far places x are from a cut's faces: negative inside the gap.

        Infinite where there is no cut.
        """
        return np.full(len(points), np.inf)

    def inside(self, points: Points) -> NDArray[np.bool_]:
        """Return which places are in the ball; it is mapped onto itself."""
        square = np.sum((points - self.center_mm) ** 2, axis=-1)
        return np.asarray(square < self.radius_mm**2)

    def share(self, points: Points) -> NDArray[np.float64]:
        """Return w."""
        offset = points - self.center_mm
        return weight(np.sum(offset**2, axis=-1) / self.radius_mm**2)

    def slope(self, points: Points) -> NDArray[np.float64]:
        """Return the gradient of w."""
        offset = (points - self.center_mm) / self.radius_mm
        rest = np.maximum(1 - np.sum(offset**2, axis=-1, keepdims=True), 0.0)
        return np.asarray(-4 * rest * offset / self.radius_mm)


def finite_vector(name: str, value: NDArray[np.float64]) -> NDArray[np.float64]:
    """Copy a finite ``(3,)``; UserError for anything else."""
    result = np.array(value, dtype=np.float64)
    if result.shape != (3,) or not np.all(np.isfinite(result)):
        raise UserError(f"a deflector's {name} must be a finite (3,), got {value}")
    result.flags.writeable = False
    return result


def refuse_fold(name: str, length_mm: float, radius_mm: float) -> None:
    """Raise FoldError for a shift that is too long for its ball."""
    most = SAFETY * radius_mm / STEEPEST
    if not length_mm <= most:
        raise FoldError(
            f"a {name} of {length_mm:.3g} mm would fold tissue within {radius_mm:g} "
            f"mm; take at most {most:.3g} mm or a larger radius"
        )
