"""How a figure changes with practice: a curve through attempts, and how sure it is.

Attempt n, counted from 1, is expected to give ``plateau + gain * f(n)``: by a power law
``f = n ** -rate`` (Newell and Rosenbloom 1981), or exponentially ``f = exp(-rate (n -
1))`` (Heathcote, Brown and Mewhort 2000). Of both the one with the smaller squares is
taken; they have the same number of constants.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

LEAST_ATTEMPTS = 4
"""Three constants go through any three attempts."""

RATES = np.geomspace(0.02, 4.0, 120)
"""Tried rates. Slower ones look like a straight line within any number of attempts that
somebody flies, faster ones like a single step."""

DRAWS = 500
SEED = 20
BAND = (5.0, 95.0)
"""Percentiles of the band."""

WINDOW = 5
"""Attempts of a moving pass rate."""


class Shape(StrEnum):
    """Name a law of practice."""

    POWER = "power law"
    EXPONENTIAL = "exponential"

    def falls(
        self, attempts: NDArray[np.float64], rates: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return f, 1 at the first attempt; shapes broadcast."""
        if self is Shape.POWER:
            return attempts**-rates
        return np.exp(-rates * (attempts - 1.0))


@dataclass(frozen=True, slots=True, eq=False)
class LearningCurve:
    """A fitted curve.

    attempts: ``(m,)`` numbers from 1 to one after the last. middle, low, high: ``(m,)``
    the curve and its band, in the figure's unit. plateau: where it goes. gain: what
    practice changes in all, from the first attempt on; negative where the figure grows.
    rate: see `Shape`. spread: standard deviation of attempts around the curve.
    """

    shape: Shape
    attempts: NDArray[np.int64]
    middle: NDArray[np.float64]
    low: NDArray[np.float64]
    high: NDArray[np.float64]
    plateau: float
    gain: float
    rate: float
    spread: float


@dataclass(frozen=True, slots=True)
class PassRate:
    """The share of passed attempts up to one of them, with a 90 % interval."""

    attempt: int
    share: float
    low: float
    high: float


def fit_learning_curve(
    figures: Sequence[float], *, draws: int = DRAWS, seed: int = SEED
) -> LearningCurve | str:
    """Return the curve through figures in the order of attempts, or why there is none.

    The band is a bootstrap of the residuals, each widened by the degrees of freedom
    that the constants take; both shapes are fitted to every draw. The same figures give
    the same bits.
    """
    count = len(figures)
    if count < LEAST_ATTEMPTS:
        return (
            f"not enough data: {LEAST_ATTEMPTS} attempts are needed, there are {count}"
        )
    measured = np.asarray(figures, np.float64)
    if not np.isfinite(measured).all():
        return "not enough data: a figure is not finite"
    attempts = np.arange(1.0, count + 1.0)
    ahead = np.arange(1.0, count + 2.0)
    shape, rate, plateau, gain = _best(attempts, measured)
    fitted = plateau + gain * shape.falls(attempts, np.array(rate))
    residuals = measured - fitted
    spread = math.sqrt(float(residuals @ residuals) / (count - 3))
    widened = (residuals - residuals.mean()) * math.sqrt(count / (count - 3))
    random = np.random.default_rng(seed)
    drawn = fitted + random.choice(widened, (draws, count))
    curves = _refitted(attempts, ahead, drawn)
    low, high = np.percentile(curves, BAND, axis=0)
    middle = plateau + gain * shape.falls(ahead, np.array(rate))
    # a band holds its curve, also where a draw's other shape lies to one side
    low, high = np.minimum(low, middle), np.maximum(high, middle)
    return LearningCurve(
        shape, ahead.astype(np.int64), middle, low, high, plateau, gain, rate, spread
    )


def moving_pass_rate(passed: Sequence[bool], window: int = WINDOW) -> list[PassRate]:
    """Return the pass rate of the last attempts at each, from the first full window on.

    The interval is Wilson's. Fewer attempts than a window give nothing.
    """
    # here, as statistics take a second to load
    from scipy.stats import binomtest

    rates = []
    for end in range(window, len(passed) + 1):
        count = sum(passed[end - window : end])
        interval = binomtest(count, window).proportion_ci(0.9, method="wilson")
        low, high = float(interval.low), float(interval.high)
        rates.append(PassRate(end, count / window, low, high))
    return rates


def _best(
    attempts: NDArray[np.float64], measured: NDArray[np.float64]
) -> tuple[Shape, float, float, float]:
    """Return shape, rate, plateau and gain of the least squares."""
    from scipy.optimize import minimize_scalar

    found = []
    for shape in Shape:

        def squares(log_rate: float, shape: Shape = shape) -> float:
            falls = shape.falls(attempts, np.array([[math.exp(log_rate)]]))
            return float(_least_squares(falls, measured[None])[2][0, 0])

        grid = [squares(math.log(rate)) for rate in RATES]
        at = int(np.argmin(grid))
        low, high = RATES[max(at - 1, 0)], RATES[min(at + 1, len(RATES) - 1)]
        finer = minimize_scalar(
            squares,
            bounds=(math.log(low), math.log(high)),
            method="bounded",
            options={"xatol": 1e-10},
        )
        best = min((grid[at], math.log(RATES[at])), (float(finer.fun), float(finer.x)))
        found.append((best[0], shape, math.exp(best[1])))
    _, shape, rate = min(found, key=lambda each: each[0])
    falls = shape.falls(attempts, np.array([[rate]]))
    plateau, gain, _ = _least_squares(falls, measured[None])
    return shape, rate, float(plateau[0, 0]), float(gain[0, 0])


def _refitted(
    attempts: NDArray[np.float64],
    ahead: NDArray[np.float64],
    drawn: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return ``(draws, m)`` the curve through each draw, of rates of the grid."""
    constants = []
    for shape in Shape:
        falls = shape.falls(attempts, RATES[:, None])
        plateau, gain, squares = _least_squares(falls, drawn)
        constants.append((plateau, gain, squares, shape.falls(ahead, RATES[:, None])))
    squares = np.concatenate([each[2] for each in constants], axis=1)
    plateau = np.concatenate([each[0] for each in constants], axis=1)
    gain = np.concatenate([each[1] for each in constants], axis=1)
    shapes = np.concatenate([each[3] for each in constants])
    row, best = np.arange(len(drawn)), squares.argmin(axis=1)
    curves: NDArray[np.float64] = shapes[best]
    return plateau[row, best, None] + gain[row, best, None] * curves


def _least_squares(
    falls: NDArray[np.float64], measured: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return plateau, gain and sum of squares of straight lines over f.

    falls: ``(rates, n)``. measured: ``(draws, n)``. Each result: ``(draws, rates)``.
    """
    f = falls - falls.mean(axis=1, keepdims=True)
    y = measured - measured.mean(axis=1, keepdims=True)
    gain = (y @ f.T) / (f * f).sum(axis=1)
    plateau = measured.mean(axis=1)[:, None] - gain * falls.mean(axis=1)
    # summed, not as a difference of squares, which loses the digits of a good fit
    rest = y[:, None, :] - gain[:, :, None] * f
    return plateau, gain, np.einsum("ijk,ijk->ij", rest, rest)
