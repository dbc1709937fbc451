"""How long something takes: wall clock and CPU time, smallest and median."""

import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

from disk import UserError

_T = TypeVar("_T")


@dataclass(frozen=True, slots=True)
class Timing:
    """Hold seconds of one call.

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
