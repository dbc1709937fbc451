"""Compiled: counters by which one thread tells another what it may read."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from renderers.lanes.atomics import fetch_add, give_back

Longs = NDArray[np.int64]


@njit(cache=True, nogil=True)
def begin_copy(begun: Longs) -> int:
    """Count a copy as begun, before anything of it is written; return its number."""
    return fetch_add(begun) + 1


@njit(cache=True, nogil=True)
def publish_copy(published: Longs) -> None:
    """Count a copy as done: whoever sees that sees all of it."""
    # a release is there for taking one off only: two more come first
    fetch_add(published)
