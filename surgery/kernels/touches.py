"""Walls that touch a tool, as both contact solvers have them: rows of `TOUCH` float64.

What reconciles their pushes stands in each solver: a tool that moves as a whole and one
that turns about the nostril share no sweep that is as fast for both.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

Doubles = NDArray[np.float64]

BALL, GAP, AT, OUTWARD, PUSH, WALL, TOUCH = 0, 1, 2, 5, 8, 9, 10
"""Columns, and their number: the ball that touches, its gap, its place (3), the unit
direction into the air (3), the push so far, row of the wall that is felt."""


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def row_for(touches: Doubles, count: int, gap: float) -> int:
    """Return the row for a wall: of too many the deepest stay; -1 for none."""
    if count < touches.shape[0]:
        return count
    at = 0
    for m in range(1, count):
        if touches[m, GAP] > touches[at, GAP]:
            at = m
    return at if touches[at, GAP] > gap else -1
