"""Compiled: counters by which one thread tells another what it may read.

They count down, so that each change is one step that orders what stands around it.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.simd.atomics import give_back, look

Longs = NDArray[np.int64]


@njit(cache=True, nogil=True)
def count_one(counter: Longs) -> int:
    """Count one more; return how many that are. Whoever sees it sees all before it.

    counter: ``(1,)`` int64, 0 at first.
    """
    return int(1 - give_back(counter))


@njit(cache=True, nogil=True)
def counted(counter: Longs) -> int:
    """Return how many were counted so far."""
    return int(-look(counter))
