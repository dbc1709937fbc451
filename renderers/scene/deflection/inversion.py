"""Where a deflector takes tissue, when only where it takes it from is given."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from renderers.scene.deflection.deflector import Deflector, Points, weight


def pushed(deflector: Deflector, points: Points, shift: Points) -> Points:
    """Solve ``x - shift w(x) = q`` for x: one number a place, how much of the shift.

    ``share - w(q + share * shift)`` rises with the share as long as nothing folds.
    """
    arm = (points - deflector.center_mm) / deflector.radius_mm
    step = shift / deflector.radius_mm
    a, b, c = ((u * v).sum(axis=-1) for u, v in ((arm, arm), (arm, step), (step, step)))

    def excess(share: NDArray[np.float64]) -> NDArray[np.float64]:
        return share - weight(a + share * (2 * b + share * c))

    share = rising_roots(excess, np.zeros(len(points)), np.ones(len(points)))
    return points + share[:, None] * shift


def rising_roots(
    function: Callable[[NDArray[np.float64]], NDArray[np.float64]],
    low: NDArray[np.float64],
    high: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Find the roots of rising functions between two bounds, to rounding.

    By secants through the ends of brackets that halve at least every third step
    (Illinois would do for one root; all are stepped together here).
    """
    f_low, f_high = function(low), function(high)
    for turn in range(64):
        span = high - low
        if turn % 3 == 2:
            at = low + 0.5 * span
        else:
            drop = np.where(f_high > f_low, f_high - f_low, 1.0)
            at = np.clip(low - f_low * span / drop, low, high)
        value = function(at)
        below = value < 0
        low, f_low = np.where(below, at, low), np.where(below, value, f_low)
        high, f_high = np.where(below, high, at), np.where(below, f_high, value)
        if np.all((high - low < 4e-16) | (value == 0)):
            break
    return np.where(np.abs(f_low) < np.abs(f_high), low, high)
