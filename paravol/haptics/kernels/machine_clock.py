"""Compiled: the machine's monotonic clock, and sleep until one of its moments (Linux).

Called from code that holds no lock of the interpreter.
"""

from typing import Any

import numpy as np
from numba import njit, types
from numpy.typing import NDArray

Longs = NDArray[np.int64]

MONOTONIC, THREAD_CPU = 1, 3
ABSOLUTE = 1
SET_TIMER_SLACK = 29

_gettime: Any = types.ExternalFunction(
    "clock_gettime", types.int32(types.int32, types.int64)
)
_nanosleep: Any = types.ExternalFunction(
    "clock_nanosleep",
    types.int32(types.int32, types.int32, types.int64, types.int64),
)
_prctl: Any = types.ExternalFunction(
    "prctl",
    types.int32(types.int32, types.int64, types.int64, types.int64, types.int64),
)


@njit(cache=True, nogil=True)
def now_ns(clock: int, spec: Longs) -> int:
    """Return a clock's time; `MONOTONIC` is what `time.monotonic` tells.

    spec: ``(2,)`` int64 to work in.
    """
    _gettime(np.int32(clock), np.int64(spec.ctypes.data))
    return int(spec[0] * 1_000_000_000 + spec[1])


@njit(cache=True, nogil=True)
def sleep_until(due_ns: int, spec: Longs) -> None:
    """Return at a moment of the monotonic clock, or soon after it.

    spec: ``(2,)`` int64 to work in.
    """
    spec[0], spec[1] = due_ns // 1_000_000_000, due_ns % 1_000_000_000
    _nanosleep(
        np.int32(MONOTONIC), np.int32(ABSOLUTE), np.int64(spec.ctypes.data), 0
    )  # fmt: skip


@njit(cache=True, nogil=True)
def wake_exactly() -> None:
    """Ask the system not to gather this thread's wake-ups with others (50 us)."""
    _prctl(np.int32(SET_TIMER_SLACK), 1, 0, 0, 0)
