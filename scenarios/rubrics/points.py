"""Points of a value: straight between knots, level beyond them."""

import math
from itertools import pairwise
from statistics import NormalDist

from scenarios.rubrics.assessment import Knots

_NORMAL = NormalDist()


def percent_of(knots: Knots, value: float) -> float:
    """Return the percent that a value gives, 0 to 100.

    knots: values that ascend, each with its percent.
    """
    if value <= knots[0][0]:
        return knots[0][1]
    for (low, first), (high, second) in pairwise(knots):
        if value <= high:
            share = (value - low) / (high - low)
            return first + share * (second - first)
    return knots[-1][1]


def percent_sigma(knots: Knots, value: float, sigma: float) -> float:
    """Return the standard deviation of the percent of a normally distributed value.

    In closed form: on a stretch where the percent is m x + c, its first two moments are
    those of a normal distribution cut off at the stretch's ends.
    """
    if not sigma > 0.0:
        return 0.0
    # about the value's own percent, so that nothing cancels
    middle = percent_of(knots, value)
    ends = [-math.inf, *(at for at, _ in knots), math.inf]
    first = second = 0.0
    for n, (low, high) in enumerate(pairwise(ends)):
        if n == 0 or n == len(knots):
            slope, level = 0.0, knots[min(n, len(knots) - 1)][1] - middle
        else:
            (x, p), (y, q) = knots[n - 1], knots[n]
            slope = (q - p) / (y - x)
            level = p - middle + slope * (value - x)
        # level + slope sigma u with u normal, between a and b
        a, b = (low - value) / sigma, (high - value) / sigma
        mass = _NORMAL.cdf(b) - _NORMAL.cdf(a)
        once = _density(a) - _density(b)
        twice = mass + _times(a) - _times(b)
        rise = slope * sigma
        first += level * mass + rise * once
        second += level**2 * mass + 2.0 * level * rise * once + rise**2 * twice
    return math.sqrt(max(second - first**2, 0.0))


def _density(at: float) -> float:
    return 0.0 if math.isinf(at) else _NORMAL.pdf(at)


def _times(at: float) -> float:
    return 0.0 if math.isinf(at) else at * _NORMAL.pdf(at)
