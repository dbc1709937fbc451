"""How far a pose of the arm may be wrong: rounding to counts, imperfect constants.

Errors propagate to first order through the closed Jacobians. A count stands for any
angle within half a step, uniformly: variance step^2 / 12 for each joint. The constants
are wrong by the same amounts in every pose, so that their part of the error is shared
between poses and does not average out; ``common_factor`` keeps it apart.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices.microscribe.kinematics.arm import ArmGeometry, Encoders
from devices.microscribe.kinematics.jacobian import (
    ALPHA,
    BETA,
    PARAMETERS,
    ZERO,
    A,
    D,
    joint_jacobian,
    parameter_jacobian,
)
from system import UserError

# 0.38 mm for the plain ones over 0.23 mm for the better ones.
PLAIN_RATIO = 1.6
BETTER_MODELS = frozenset({"DX"})


@dataclass(frozen=True, slots=True)
class ParameterSpread:
    """Standard deviations of an arm's constants about the stated ones.

    The defaults add up to a tip error of 0.25 mm rms over the workspace (measured),
    about what the maker states for the better arms (0.23 mm; 0.38 mm for the plain
    ones). 1.6 times as much makes one of the plain ones.
    """

    length_mm: float = 0.03
    twist_rad: float = math.radians(0.015)
    zero_rad: float = math.radians(0.015)

    def __post_init__(self) -> None:
        spread = (self.length_mm, self.twist_rad, self.zero_rad)
        if not all(math.isfinite(s) and s >= 0.0 for s in spread):
            raise UserError(f"spreads must be finite and not negative, got {spread}")

    def scaled(self, ratio: float) -> "ParameterSpread":
        """Return spreads that are ``ratio`` times as large."""
        return ParameterSpread(
            self.length_mm * ratio, self.twist_rad * ratio, self.zero_rad * ratio
        )

    @classmethod
    def of_model(cls, model: str) -> "ParameterSpread":
        """Return what the maker states for a model; the plain one's when unknown."""
        spread = cls()
        return spread if model in BETTER_MODELS else spread.scaled(PLAIN_RATIO)

    def deviations(self) -> NDArray[np.float64]:
        """Return the standard deviation of each parameter, (25,)."""
        sigma = np.empty(PARAMETERS)
        sigma[ALPHA] = self.twist_rad
        sigma[A] = sigma[D] = self.length_mm
        sigma[ZERO] = self.zero_rad
        sigma[BETA] = self.twist_rad
        return sigma

    def draw(self, rng: np.random.Generator) -> NDArray[np.float64]:
        """Draw the deviations of one arm, (25,)."""
        drawn: NDArray[np.float64] = rng.normal(size=PARAMETERS) * self.deviations()
        return drawn


EXACT = ParameterSpread(0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class ArmUncertainty:
    """Uncertainty of the poses of one arm; angles are (..., 6) radians."""

    geometry: ArmGeometry
    encoders: Encoders
    spread: ParameterSpread = EXACT

    def steps(self) -> NDArray[np.float64]:
        """Return the angle of one count of each joint, (6,); 0 without encoder."""
        turn = np.array(self.encoders.turn, dtype=np.float64)
        return np.where(turn > 1.0, 2.0 * np.pi / turn, 0.0)

    def quantisation(self, angles: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the covariance (..., 6, 6) of rounding; mm and radians."""
        factor = joint_jacobian(self.geometry, angles) * (self.steps() / np.sqrt(12.0))
        return _squared(factor)

    def common_factor(self, angles: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the tip's change, (..., 6, 25), per standard deviation of each."""
        scaled: NDArray[np.float64] = (
            parameter_jacobian(self.geometry, angles) * self.spread.deviations()
        )
        return scaled


def _squared(factor: NDArray[np.float64]) -> NDArray[np.float64]:
    product: NDArray[np.float64] = factor @ np.swapaxes(factor, -1, -2)
    return product
