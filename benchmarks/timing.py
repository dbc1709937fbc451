"""How long something takes: wall clock and CPU time, smallest and median."""

import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from system import UserError

_T = TypeVar("_T")


@dataclass(frozen=True, slots=True)
class Timing:
    """Seconds of one call.

    min_s, median_s: wall clock over the repeats. cpu_s: smallest CPU time.
    """

    min_s: float
    median_s: float
    cpu_s: float
    repeats: int

    @classmethod
    def of(cls, walls: list[float], cpus: list[float]) -> "Timing":
        """Summarise the repeats; both lists hold one value for each."""
        return cls(min(walls), statistics.median(walls), min(cpus), len(walls))

    @classmethod
    def sum(cls, timings: list["Timing"]) -> "Timing":
        """Add what was timed one after the other."""
        return cls(
            sum(t.min_s for t in timings),
            sum(t.median_s for t in timings),
            sum(t.cpu_s for t in timings),
            min(t.repeats for t in timings),
        )


def measure(
    call: Callable[[], _T],
    *,
    budget_s: float = 1.0,
    least: int = 3,
    most: int = 15,
    warm_up: bool = True,
    cpu_clock: Callable[[], float] = time.process_time,
) -> tuple[Timing, _T]:
    """Call repeatedly until the budget is spent; give times and the last result.

    The first call, which compiles and fills caches, is dropped when `warm_up`.
    cpu_clock: `time.process_time` counts all threads, `time.thread_time` this one.
    """
    if not 1 <= least <= most:
        raise UserError(f"repeats must be 1 <= least <= most, got {least}, {most}")
    if warm_up:
        call()
    walls: list[float] = []
    cpus: list[float] = []
    while True:
        cpu, wall = cpu_clock(), time.perf_counter()
        result = call()
        walls.append(time.perf_counter() - wall)
        cpus.append(cpu_clock() - cpu)
        spent = sum(walls)
        # Another repeat only if it will probably still fit.
        room = spent + spent / len(walls) <= budget_s
        if len(walls) >= most or (len(walls) >= least and not room):
            return Timing.of(walls, cpus), result


def once(call: Callable[[], _T]) -> tuple[Timing, _T]:
    """Time one call, the first."""
    return measure(call, least=1, most=1, warm_up=False)


class CallClock:
    """Time calls; the first, which compiles or finds nothing prepared, is left out."""

    def __init__(self) -> None:
        self.walls: list[float] = []
        self.cpus: list[float] = []

    def time(self, call: Callable[[], _T]) -> _T:
        """Call and keep what it took."""
        timing, result = once(call)
        self.walls.append(timing.min_s)
        self.cpus.append(timing.cpu_s)
        return result

    def timing(self) -> Timing:
        """Return the times of the calls."""
        return Timing.of(self.walls[1:], self.cpus[1:])

    def counters(self, what: str) -> dict[str, float]:
        """Return milliseconds of CPU time of a median call and of one in twenty."""
        ms = np.array(self.cpus[1:]) * 1e3
        return {
            f"{what}_ms": float(np.median(ms)),
            f"{what}_ms_95_percent": float(np.percentile(ms, 95)),
            f"{what}_calls": len(ms),
        }
