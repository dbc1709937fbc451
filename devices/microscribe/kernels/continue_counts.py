"""Compiled: one packet's counts, continued over their wraps and judged.

The arithmetic is plain float64 in a fixed order, so the bits are those of the same
lines run by the interpreter.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit("b1(i8[::1],i8[::1],i8,i8[::1],f8[::1],f8,f8,i8[::1])", cache=True)
def continue_counts(
    reading: NDArray[np.int64],
    last: NDArray[np.int64],
    field: int,
    windows: NDArray[np.int64],
    fastest: NDArray[np.float64],
    ticks: float,
    allowed: float,
    counts: NDArray[np.int64],
) -> bool:
    """Continue unwrapped counts (6,) to a new reading of a field that wraps.

    windows: counts modulo which a joint's steps are told apart. Returns whether none
    went further than its ``fastest`` counts a tick in so many ticks, and ``allowed``
    beside that. Right as long as no joint turns by half the field between two readings.
    """
    plausible = True
    for i in range(6):
        step = (reading[i] - last[i] + field // 2) % field - field // 2
        counts[i] = last[i] + step
        half = windows[i] // 2
        step = (step + half) % windows[i] - half
        if abs(step) > fastest[i] * ticks + allowed:
            plausible = False
    return plausible
