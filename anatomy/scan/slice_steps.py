"""The steps between slices: which of them are holes that lost slices left.

Steps are compared with the step of their own section, not with their neighbours alone:
where every second slice is lost, all neighbours are as wide.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

WHOLE_MULTIPLE = 0.03
"""Relative departure from a whole multiple of the section's step that a step may have
to count as missing slices. Steps that an operator chose (4 and 7 mm) are none."""

MOST_DEPARTURE = 0.12
"""Of the section's step; otherwise each hole of 17 slices were a whole multiple."""

AS_THICK = 0.2
"""Relative departure from the steps' ratio at which slices count as thick as they
are far apart: 5 mm below the skull base and 10 mm above lose nothing."""


FEWEST_STEPS = 3
"""Two steps of an uneven stack are multiples by chance."""

MOST_BETWEEN = 3
"""Steps of more thicknesses each are no sign of a step as small as the thickness."""


@dataclass(slots=True)
class _Section:
    """Hold neighbouring steps that are whole multiples of one."""

    first: int
    steps: list[float] = field(default_factory=list)
    counts: list[int] = field(default_factory=list)

    @property
    def step(self) -> float:
        """Return the one step, averaged over all."""
        return sum(self.steps) / sum(self.counts)

    def takes(self, step: float) -> bool:
        """Add a step if it fits."""
        count = _whole(step, self.step) if self.steps else 1
        if count:
            self.steps.append(step)
            self.counts.append(count)
            return True
        # so far every second slice was missing
        finer = [_whole(held, step) for held in self.steps]
        if not all(finer):
            return False
        self.steps.append(step)
        self.counts = [*finer, 1]
        return True

    def joins(self, other: "_Section") -> bool:
        """Add the section that follows, if the smaller step of both fits all."""
        step = min(self.step, other.step)
        steps = [*self.steps, *other.steps]
        counts = [_whole(held, step) for held in steps]
        if not all(counts):
            return False
        self.steps, self.counts = steps, counts
        return True


def lost_slices(
    steps_mm: NDArray[np.float64], thickness_mm: NDArray[np.float64] | None = None
) -> list[tuple[int, int]]:
    """List the holes of a stack: index of the slice before, how many are lost.

    steps_mm: ``(n - 1,)`` between ordered slices. thickness_mm: ``(n,)`` of the slices,
    None or NaN where it is not known: slices that are thicker where they lie further
    apart were made so, and unequal steps may share one thickness that fits them all.
    """
    thick = np.full(len(steps_mm) + 1, np.nan) if thickness_mm is None else thickness_mm
    found = []
    for section in _sections(steps_mm, thick):
        if len(section.steps) < min(FEWEST_STEPS, len(steps_mm)):
            continue
        counts = np.array(section.counts)
        places = section.first + np.arange(len(counts))
        # as thick as the thicker one of the two slices about each step
        here = np.fmax(thick[places], thick[places + 1])
        single = counts == 1
        base = np.median(here[single] if single.any() else here)
        meant = np.abs(here / base - counts) <= AS_THICK * counts
        found += [
            (int(place), int(count) - 1)
            for place, count, is_meant in zip(places, counts, meant, strict=True)
            if count > 1 and not is_meant
        ]
    return found


def _sections(
    steps_mm: NDArray[np.float64], thick: NDArray[np.float64]
) -> list[_Section]:
    """Part the steps where no common one fits any more."""
    common = float(thick[0])
    is_uneven = np.ptp(steps_mm) > WHOLE_MULTIPLE * steps_mm.min()
    if is_uneven and np.ptp(thick) <= WHOLE_MULTIPLE * common:
        counts = [_whole(float(step), common) for step in steps_mm]
        if all(counts) and min(counts) <= MOST_BETWEEN:
            return [_Section(0, steps_mm.tolist(), counts)]
    found: list[_Section] = []
    for i, step in enumerate(steps_mm.tolist()):
        if not found or not found[-1].takes(step):
            found.append(_Section(i, [step], [1]))
    joined = found[:1]
    for section in found[1:]:
        if not joined[-1].joins(section):
            joined.append(section)
    return joined


def _whole(step: float, base: float) -> int:
    """Return how many times as long a step is; 0 where it is no whole multiple."""
    times = step / base
    count = round(times)
    allowed = min(WHOLE_MULTIPLE * count, MOST_DEPARTURE)
    return count if count >= 1 and abs(times - count) <= allowed else 0
