"""How a lens bends its own law: barrel and pincushion distortion.

Brown's radial polynomial (Photogrammetric Engineering 32, 1966) upon the undistorted
radius u, the tangent of a pinhole's angle or the angle of an equidistant lens (there
it is the fisheye polynomial of Kannala and Brandt, PAMI 28, 2006, to its second term):
``D(u) = u (1 + k1 u**2 + k2 u**4)``. It is a lens as long as D rises; where it turns
back (`fold`) two rays would fall on one pixel.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from system import UserError

ROUNDS = 60
"""Bracketed Newton steps until an inverse is exact to rounding; three are usual."""


@dataclass(frozen=True, slots=True)
class Distortion:
    """The coefficients; both 0 for a lens without distortion."""

    k1: float = 0.0
    k2: float = 0.0

    def __post_init__(self) -> None:
        for name, value in (("k1", self.k1), ("k2", self.k2)):
            if not (math.isfinite(value) and abs(value) <= 100):
                raise UserError(
                    f"distortion {name} must be within -100..100, got {value}"
                )

    @property
    def is_none(self) -> bool:
        """Return whether the lens is as its law says."""
        return self.k1 == 0 and self.k2 == 0

    @property
    def fold(self) -> float:
        """Return the radius from which the picture turns back on itself; inf for none.

        The first zero of the slope ``1 + 3 k1 u**2 + 5 k2 u**4``.
        """
        # 5 k2 = a, 3 k1 = b: the first positive root of a s**2 + b s + 1, s = u**2
        a, b = 5 * self.k2, 3 * self.k1
        square = b * b - 4 * a
        if square < 0 or (a >= 0 and b >= 0):
            return math.inf
        # 2 / (-b + root) keeps its digits for small a and is the smaller root
        root = math.sqrt(square)
        return math.sqrt(2 / (root - b)) if root > b else math.inf

    def of(self, u: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return D(u)."""
        s = u * u
        return u * (1 + s * (self.k1 + s * self.k2))

    def stretch(self, u: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return D(u) / u, 1 at 0."""
        s = u * u
        return 1 + s * (self.k1 + s * self.k2)

    def stretches(self, widest: float) -> tuple[float, float]:
        """Return the least and the largest `stretch` from 0 to `widest`."""
        at = [0.0, widest]
        if self.k2 != 0 and 0 < -self.k1 / (2 * self.k2) < widest * widest:
            at.append(math.sqrt(-self.k1 / (2 * self.k2)))
        found = self.stretch(np.array(at))
        return float(found.min()), float(found.max())

    def inverse(self, d: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return u below the fold with D(u) = d; NaN beyond what the lens can show."""
        if self.is_none:
            return d
        fold = self.fold
        top = float(self.of(np.array(fold))) if math.isfinite(fold) else math.inf
        # D rises from 0 to its top: bracket, then Newton, halving where it leaves
        low = np.zeros_like(d)
        high = np.full_like(d, min(fold, 1e12))
        if math.isinf(fold):
            high = np.maximum(1.0, d)
            while np.any(short := self.of(high) < d):
                high = np.where(short, 2 * high, high)
        u = np.minimum(d, high)
        for _ in range(ROUNDS):
            error = self.of(u) - d
            low, high = np.where(error < 0, u, low), np.where(error > 0, u, high)
            s = u * u
            slope = 1 + s * (3 * self.k1 + s * 5 * self.k2)
            with np.errstate(divide="ignore", invalid="ignore"):
                new = u - error / slope
            inside = (new >= low) & (new <= high)
            new = np.where(error == 0, u, np.where(inside, new, (low + high) / 2))
            if np.array_equal(new, u):
                break
            u = new
        return np.where(d <= top, u, np.nan)


NO_DISTORTION = Distortion()
