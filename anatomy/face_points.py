"""Places on the front of a scanned head that a stylus can touch."""

import numpy as np
from numpy.typing import NDArray

from renderers.scene.volume import Volume

AROUND_MM = ((2.0, 48.0), (-38.0, 14.0), (41.0, 20.0), (4.0, -26.0))
"""Sideways and upwards from the nose, about where nasion, cheeks and chin are. No two
distances are alike, so that a wrong order shows."""

REACH_MM = 120.0
STEP_MM = 0.5


def face_points(
    field: Volume, nose_mm: NDArray[np.float64]
) -> dict[str, NDArray[np.float64]]:
    """Find points ``(3,)`` LPS of the skin around the nose, by name.

    field: CT numbers above those of the surface, negative in air. nose_mm: a nostril.
    A place that the scan does not show is left out.
    """
    found = {}
    for number, (aside, above) in enumerate(AROUND_MM, start=1):
        depths = np.arange(-REACH_MM, REACH_MM, STEP_MM)
        sideways, up = np.full_like(depths, aside), np.full_like(depths, above)
        line = nose_mm + np.stack([sideways, depths, up], axis=1)
        height = field.sample(line)
        entered = np.flatnonzero((height[:-1] < 0) & (height[1:] >= 0))
        if not len(entered):
            continue
        i = int(entered[0])
        share = -height[i] / (height[i + 1] - height[i])
        found[f"face {number}"] = line[i] + share * (line[i + 1] - line[i])
    return found
