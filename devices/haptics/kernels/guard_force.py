"""Compiled: the last instance before any device that pushes.

Whatever a force model asks for, a device gets no more than its limit, nothing while no
poses come or they cannot be, and after either a force that grows from zero.
"""

import math
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from devices.haptics.force_records import (
    AWAY,
    GONE,
    LYING,
    NEW,
    NO_FAULT,
    NO_FORCE,
    SILENT,
)

Doubles = NDArray[np.float64]

UNEVEN = 1e-3
"""How far the rows of a rotation may be from unit length, squared."""


@njit(cache=True, nogil=True)
def _is_a_pose(reading: Any) -> bool:
    """Return whether all numbers are finite and the matrix has unit rows."""
    for i in range(3):
        squared = 0.0
        for j in range(3):
            squared += reading.rotation[i, j] * reading.rotation[i, j]
        # written so that no number fails
        if not abs(squared - 1.0) < UNEVEN or not math.isfinite(reading.position_mm[i]):
            return False
    return True


@njit(cache=True, nogil=True)
def _looked_at(guard: Any, status: int, reading: Any, now_ns: int) -> int:
    """Judge what a device measured; return why it must not be pushed, or 0."""
    if status == GONE:
        guard.is_seen = 0
        return AWAY
    if status != NEW:
        if guard.is_seen and now_ns - guard.heard_ns < guard.silence_ns:
            return int(guard.fault)
        return SILENT
    guard.heard_ns = now_ns
    if not _is_a_pose(reading):
        guard.is_seen = 0
        return LYING
    squared = 0.0
    for i in range(3):
        moved = reading.position_mm[i] - guard.seen_mm[i]
        squared += moved * moved
        guard.seen_mm[i] = reading.position_mm[i]
    elapsed_s = (now_ns - guard.seen_ns) * 1e-9
    guard.seen_ns = now_ns
    was_seen = guard.is_seen
    guard.is_seen = 1
    if was_seen and math.sqrt(squared) > guard.speed_mm_s * elapsed_s:
        return LYING
    return NO_FAULT


@njit(cache=True, nogil=True)
def hear_pose(guard: Any, status: int, reading: Any, now_ns: int) -> bool:
    """Take what reading a device returned; return whether its pose may be used.

    guard, reading: records `GUARD` and `READING`. status: `NEW`, `NO_NEWS` or `GONE`.
    A pose may be used while a single measurement is missing.
    """
    before = guard.fault
    guard.fault = _looked_at(guard, status, reading, now_ns)
    if guard.fault != NO_FAULT:
        if guard.fault != before:
            guard.faults[guard.fault] += 1
        guard.is_ramping = 0
        return False
    if not guard.is_ramping:
        guard.is_ramping = 1
        guard.ramp_from_ns = now_ns
    return True


@njit(cache=True, nogil=True)
def guard_force(guard: Any, force_n: Doubles, now_ns: int) -> None:
    """Change a force, ``(3,)`` N, into one that a device may get.

    To be called after `hear_pose` of the same moment. Its direction is kept where its
    size is not.
    """
    if guard.fault == NO_FAULT and not (
        math.isfinite(force_n[0])
        and math.isfinite(force_n[1])
        and math.isfinite(force_n[2])
    ):
        guard.fault = NO_FORCE
        guard.faults[NO_FORCE] += 1
        guard.is_ramping = 0
    if guard.fault != NO_FAULT:
        force_n[:] = 0.0
        return
    largest = max(abs(force_n[0]), abs(force_n[1]), abs(force_n[2]))
    if largest == 0.0:
        return
    # by the largest first: squares of huge numbers are none
    x, y, z = force_n[0] / largest, force_n[1] / largest, force_n[2] / largest
    unit = math.sqrt(x * x + y * y + z * z)
    share = (now_ns - guard.ramp_from_ns) / max(guard.ramp_ns, 1)
    size = min(largest * unit, guard.limit_n) * min(max(share, 0.0), 1.0)
    # a rounding below the limit, never above
    size *= (1.0 - 1e-15) / unit
    force_n[0], force_n[1], force_n[2] = size * x, size * y, size * z
