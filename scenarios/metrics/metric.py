"""What a metric is, and what came out of one."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from scenarios.metrics.measured import Measured

SCOPE, TOOL, HANDS, PATIENT = "scope", "tool", "both hands", "patient"
"""Roles: who moved, or what was done to whom."""

Interval = tuple[float, float]
"""Seconds of the session, from and to."""


class Found(NamedTuple):
    """A value, or why there is none, and the moments that it came from.

    sigma: what the metric itself may err by; None for nothing but the device's noise.
    """

    value: float | None
    intervals: tuple[Interval, ...] = ()
    reason: str = ""
    sigma: float | None = None


def too_little(needed: str) -> Found:
    """Return the answer of a metric that lacks data."""
    return Found(None, (), f"not enough data: {needed}")


Answer = Found | Mapping[str, Found]
"""One value, or one for each target, hazard or structure, by its name."""


@dataclass(frozen=True, slots=True)
class Definition:
    """Define a metric. docs/metrics.md has its formula and source.

    compute: a pure function of what was measured. filter: "raw" or "low-passed".
    moves: a still tool has a value too, by noise alone: the noise floor. is_slow: its
    sigma comes from few draws of the noise. sees_tool: it is about the scope, and reads
    where the tool was.
    """

    name: str
    role: str
    unit: str
    compute: "Callable[[Measured], Answer]"
    filter: str = "raw"
    moves: bool = False
    is_slow: bool = False
    sees_tool: bool = False

    @property
    def needs_tool(self) -> bool:
        """Return whether the poses of the tool matter to it."""
        return self.sees_tool or self.role in (TOOL, HANDS)

    def answers(self, measured: "Measured") -> dict[str, Found]:
        """Return the values by full names: ``time in margin: orbit``."""
        answer = self.compute(measured)
        if isinstance(answer, Found):
            return {self.name: answer}
        return {f"{self.name}: {detail}": found for detail, found in answer.items()}


@dataclass(frozen=True, slots=True)
class Metric:
    """One result.

    value: None where there is none; reason says why. sigma: 1 sigma of the device's
    noise, or of the metric itself where it tells that, in the same unit; None where it
    is unknown. floor: value of a tool held still. intervals: the seconds of the session
    that the value came from.
    """

    name: str
    role: str
    unit: str
    value: float | None
    reason: str = ""
    filter: str = "raw"
    sigma: float | None = None
    floor: float | None = None
    intervals: tuple[Interval, ...] = ()

    @property
    def is_noise(self) -> bool:
        """Return whether a tool held still would have given as much."""
        return (
            self.value is not None
            and self.floor is not None
            and self.value <= self.floor + 2.0 * (self.sigma or 0.0)
        )
