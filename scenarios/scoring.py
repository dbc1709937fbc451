"""What a flight was worth, from geometry alone; pictures are never read."""

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

CONTACT_MM = 0.0
"""A gap below this is a contact."""

STILL_MM = 0.5
"""The path grows when the tip has moved this far from where it last grew. Whole counts
of an arm shake the tip by 0.1 mm rms: summed at 100 Hz over 25 s that alone would make
a path of 350 mm out of 240."""

ABSENT_S = 0.5
"""Longer than this between two samples, the device was away: nobody saw the way that
the tip went meanwhile, and where it comes back is no part of the path."""


@dataclass(frozen=True, slots=True)
class Score:
    """Sum up a session.

    path_length_mm: length of the tip's path, in steps of at least `STILL_MM`, without
        what happened while nothing was measured.
    min_clearance_mm: smallest gap between the scope's shaft and tissue.
    contacts: number of separate times the gap fell below zero.
    target_distance_mm: nearest approach of the tip to each target.
    """

    duration_s: float
    path_length_mm: float
    min_clearance_mm: float
    contacts: int
    target_distance_mm: dict[str, float]


@dataclass(slots=True)
class Scorer:
    """Accumulate a score, sample by sample, in order of time.

    targets: world positions ``(3,)`` in mm by name.
    """

    targets: dict[str, NDArray[np.float64]]
    _first_s: float | None = None
    _last_s: float = 0.0
    _counted_tip: NDArray[np.float64] | None = None
    _length: float = 0.0
    _gap: float = float("inf")
    _contacts: int = 0
    _touching: bool = False
    _nearest: dict[str, float] = field(default_factory=dict)

    def add(self, time_s: float, tip_mm: NDArray[np.float64], gap_mm: float) -> None:
        """Take in one sample; times must not run backwards."""
        if self._first_s is None:
            self._first_s = time_s
        elif time_s < self._last_s:
            raise ValueError(
                f"samples must be in order of time: {time_s} after {self._last_s}"
            )
        if self._counted_tip is None or time_s - self._last_s > ABSENT_S:
            self._counted_tip = tip_mm
        self._last_s = time_s
        moved = _length(tip_mm - self._counted_tip)
        if moved >= STILL_MM:
            self._length += moved
            self._counted_tip = tip_mm
        self._gap = min(self._gap, gap_mm)
        touching = gap_mm < CONTACT_MM
        self._contacts += touching and not self._touching
        self._touching = touching
        for name, position in self.targets.items():
            distance = _length(tip_mm - position)
            self._nearest[name] = min(self._nearest.get(name, distance), distance)

    def score(self) -> Score:
        """Give the score so far."""
        first = self._last_s if self._first_s is None else self._first_s
        return Score(
            duration_s=self._last_s - first,
            path_length_mm=self._length,
            min_clearance_mm=self._gap,
            contacts=self._contacts,
            target_distance_mm=dict(self._nearest),
        )


def _length(vector: NDArray[np.float64]) -> float:
    """Give the bits of `np.linalg.norm` in a third of its time."""
    return math.sqrt(vector.dot(vector))
