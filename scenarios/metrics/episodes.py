"""Stretches of time in which something holds, with hysteresis."""

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from scenarios.metrics.metric import Interval

Doubles = NDArray[np.float64]


def held(opens: NDArray[np.bool_], closes: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the state ``(n,)`` of a switch that is off at first.

    A sample that opens it puts it on, one that closes it off, others leave it; one
    that does both opens it.
    """
    acts = opens | closes
    last = np.maximum.accumulate(np.where(acts, np.arange(len(opens)), -1))
    return (last >= 0) & opens[np.maximum(last, 0)]


def stretches(state: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Return where a state ``(n,)`` is on: first place, and the one after the last."""
    edges = np.diff(np.concatenate([[0], state.astype(np.int8), [0]]))
    begins, ends = np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)
    return list(zip(begins.tolist(), ends.tolist(), strict=True))


def weights(time_s: Doubles, gap_s: float) -> Doubles:
    """Return how long each sample's state lasts ``(n,)``: until the next sample.

    Nothing lasts over a gap, and the last sample's state not at all.
    """
    apart = np.diff(time_s)
    lasting = np.where((apart > 0.0) & (apart <= gap_s), apart, 0.0)
    return np.concatenate([lasting, np.zeros(min(len(time_s), 1))])


def intervals(
    time_s: Doubles, state: NDArray[np.bool_], gap_s: float
) -> tuple[Interval, ...]:
    """Return the seconds in which a state ``(n,)`` was on, split at gaps."""
    lasting = weights(time_s, gap_s)
    found: list[Interval] = []
    for begin, end in stretches(state):
        breaks = np.flatnonzero(lasting[begin : end - 1] == 0.0) + begin + 1
        cuts = [begin, *breaks.tolist(), end]
        for first, after in pairwise(cuts):
            last = after - 1
            found.append((float(time_s[first]), float(time_s[last] + lasting[last])))
    return tuple(found)
