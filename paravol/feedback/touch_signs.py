"""How hard a tool presses, what that breaks, and how near it is to a hazard."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum

from scenarios.instruments.catalogue import MOST_N, USUAL_N

FULL_N = 20.0
"""End of every scale of force: the thickest wall that is known, the skull base, breaks
at 17.8 N."""

FELT_N = 0.05
"""Less is no press: about the weight of a probe's tip."""

HIGH_SHARE, NEAR_SHARE = 0.5, 0.8
"""Shares of a wall's break force from which a press is high, and near the break."""

MARGIN_MM = 3.0
"""So near a hazard is told by line and tone."""

UNKNOWN = "--"


class Strain(Enum):
    """Name how near a press is to a break. Each has a word, so that colour tells no
    more than can be read."""

    NONE = "no press"
    LOW = "low"
    HIGH = "high"
    BREAKING = "breaks"
    EXCESSIVE = "too hard"
    """Nothing breaks there, but nobody presses so."""


@dataclass(frozen=True, slots=True)
class TouchSigns:
    """What can be told of a touch at one moment.

    force_n: how hard the tool presses, N; None where nobody computes it. wall: what it
    presses on, "" for nothing. limit_n: the force at which that breaks, None where it
    does not. hazard: the nearest hazard and how near a tool is, mm, negative inside;
    None where there is none or nobody knows. breaks, bites: how many walls broke and
    how many bites were taken so far. broken: the wall that broke last, and broken_n
    the force that broke it, N. taken_mm3: what was taken so far, by tissue. bite_mm3:
    what the tool would take where it is.
    """

    force_n: float | None = None
    wall: str = ""
    limit_n: float | None = None
    hazard: tuple[str, float] | None = None
    breaks: int = 0
    broken: str = ""
    broken_n: float = 0.0
    bites: int = 0
    taken_mm3: Mapping[str, float] = field(default_factory=dict)
    bite_mm3: Mapping[str, float] = field(default_factory=dict)

    @property
    def share(self) -> float:
        """Return the press as a share of the break force, 0 to 1.

        Where nothing breaks it is the share of the whole scale.
        """
        force = self._force()
        limit = FULL_N if self.limit_n is None else self.limit_n
        if force < FELT_N or not limit > 0.0:
            return 0.0
        return min(force / limit, 1.0)

    @property
    def strain(self) -> Strain:
        """Return the press in a word: by what it breaks, else by what is usual."""
        share = self.share
        if share == 0.0:
            return Strain.NONE
        if self.limit_n is None:
            force = self._force()
            if force > MOST_N:
                return Strain.EXCESSIVE
            return Strain.HIGH if force > USUAL_N else Strain.LOW
        if share < HIGH_SHARE:
            return Strain.LOW
        return Strain.HIGH if share < NEAR_SHARE else Strain.BREAKING

    @property
    def hazard_mm(self) -> float:
        """Return how near the nearest hazard is, mm; infinite for none."""
        if self.hazard is None or not math.isfinite(self.hazard[1]):
            return math.inf
        return self.hazard[1]

    @property
    def is_near_hazard(self) -> bool:
        """Return whether a tool is within the margin of a hazard."""
        return self.hazard_mm < MARGIN_MM

    def force_text(self) -> str:
        """Return the force, the one that breaks what is pressed on, and its name."""
        if self.force_n is None:
            return UNKNOWN
        words = f"{self._force():.1f} N"
        if self.share > 0.0 and self.limit_n is not None:
            words = f"{self._force():.1f} of {self.limit_n:.1f} N"
        if self.share > 0.0 and self.wall:
            words += f", {self.wall}"
        return words

    def hazard_text(self) -> str:
        """Return the nearest hazard and how near it is."""
        if self.hazard is None:
            return UNKNOWN
        name, distance_mm = self.hazard
        if distance_mm < 0.0:
            return f"{-distance_mm:.1f} mm inside {name}"
        return f"{distance_mm:.1f} mm to {name}"

    def break_text(self) -> tuple[str, str]:
        """Return the caption of the last break: what broke, and at which force."""
        return f"Broken: {self.broken}", f"It gave way at {self.broken_n:.1f} N."

    def _force(self) -> float:
        force = self.force_n
        return force if force is not None and math.isfinite(force) else 0.0


NO_SIGNS = TouchSigns()
