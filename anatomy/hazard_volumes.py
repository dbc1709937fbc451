"""Distances to the structures that must not be hurt, sampled on a grid."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from renderers.scene.volume import Volume

UNIT_MM = 0.01
"""Distances are stored as int16 in these steps."""

FARTHEST_MM = 25.0
"""Distances are clipped to this on either side."""


@dataclass(frozen=True, slots=True)
class HazardVolumes:
    """Hold the signed distance to each hazard, negative inside, on the head's grid.

    volumes: int16 in steps of `UNIT_MM`, by name: of both sides the nearer one.
    source: "phantom" or the file of labels that they were measured from.
    """

    volumes: Mapping[str, Volume]
    source: str = "phantom"

    @property
    def names(self) -> tuple[str, ...]:
        """Return the names of the hazards."""
        return tuple(self.volumes)

    def distance_mm(
        self, name: str, points_mm: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Interpolate the distance to one hazard at ``(..., 3)`` LPS points."""
        return self.volumes[name].sample(points_mm) * UNIT_MM

    def nearest(self, point_mm: NDArray[np.float64]) -> tuple[str, float]:
        """Return the nearest hazard's name and its distance in mm from one point."""
        found = {name: float(self.distance_mm(name, point_mm)) for name in self.names}
        name = min(found, key=found.__getitem__)
        return name, found[name]
