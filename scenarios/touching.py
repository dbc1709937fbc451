"""Fiducials touched with the stylus, one after the other, pedal down at each."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

PEDAL = 1
"""Button bit that says "this is the point"."""

LARGEST_SPREAD_MM = 1.0
"""A hand resting on a fiducial shakes by a tenth of this; more means that it slid."""


@dataclass(slots=True)
class Touches:
    """Collect touched points from a stream of tip positions.

    While the pedal is down positions are gathered; when it comes up their mean is a
    touched point. A touch during which the tip moved by more than `LARGEST_SPREAD_MM`
    from its mean does not count, and is reported in `refused`.
    """

    wanted: int
    points_mm: list[NDArray[np.float64]] = field(default_factory=list)
    refused: int = 0
    _held: list[NDArray[np.float64]] = field(default_factory=list)

    @property
    def is_complete(self) -> bool:
        """Tell whether all wanted points have been touched."""
        return len(self.points_mm) >= self.wanted

    def add(self, tip_mm: NDArray[np.float64], buttons: int) -> bool:
        """Take in one sample; tell whether it completed a touch."""
        if buttons & PEDAL:
            self._held.append(np.array(tip_mm))
            return False
        if not self._held:
            return False
        held = np.stack(self._held)
        self._held.clear()
        mean = held.mean(axis=0)
        if np.linalg.norm(held - mean, axis=1).max() > LARGEST_SPREAD_MM:
            self.refused += 1
            return False
        self.points_mm.append(mean)
        return True
