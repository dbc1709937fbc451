"""How much air is left around a straight shaft."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from renderers.scene import Volume

_STEP_MM = 0.25
"""Distance between samples along the shaft. The distance field changes by at most
1 mm per mm, so a sample misses at most half a step of clearance."""

_FAR_MM = 1000.0
"""Clearance outside the field: more than any tool is long."""


@dataclass(frozen=True, slots=True)
class Clearance:
    """Report the smallest gap between a tool's surface and tissue.

    gap_mm: negative when the tool is in tissue.
    at_mm: ``(3,)`` world point on the tool's axis where the gap is smallest.
    """

    gap_mm: float
    at_mm: NDArray[np.float64]


def shaft_clearance(
    distance: Volume,
    world_from_tip: NDArray[np.float64],
    radius_mm: float,
    length_mm: float,
) -> Clearance:
    """Measure the gap of a round-ended straight shaft in a signed distance field.

    distance: mm, negative in air. What lies outside the field is outside the head
        and counts as air.
    world_from_tip: 4x4, origin at the tip's end face, +z back up the shaft. The
        shaft is a capsule: its end sphere is centred one radius behind the tip.
    """
    along = np.arange(radius_mm, length_mm + _STEP_MM / 2, _STEP_MM)
    points = world_from_tip[:3, 3] + along[:, None] * world_from_tip[:3, 2]
    open_air = distance.with_values(distance.values, -_FAR_MM)
    air = -open_air.sample(points)
    nearest = int(np.argmin(air))
    return Clearance(float(air[nearest] - radius_mm), points[nearest])
