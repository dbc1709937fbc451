"""Places on the front of a scanned head that a stylus can touch."""

import numpy as np
from numpy.typing import NDArray

from renderers.scene.volume import Volume

AROUND_MM = ((2.0, 48.0), (-38.0, 14.0), (41.0, 20.0), (4.0, -26.0))
"""Sideways and upwards from the nose, about where nasion, cheeks and chin are. No two
distances are alike, so that a wrong order shows."""

FACE_RADIUS_MM = 1.0

REACH_MM = 120.0
STEP_MM = 0.5


SHARES = (1.0, 0.75, 0.5)
"""Of those ways, tried in turn until the scan shows skin at all four places."""


def face_points(
    field: Volume, nose_mm: NDArray[np.float64]
) -> dict[str, NDArray[np.float64]]:
    """Find points ``(3,)`` LPS of the skin around the nose, by name.

    field: CT numbers above those of the surface, negative in air. nose_mm: a nostril.
    A place that the scan does not show is left out.
    """
    found: dict[str, NDArray[np.float64]] = {}
    for share in SHARES:
        seen = {}
        for number, (aside, above) in enumerate(AROUND_MM, start=1):
            way = share * np.array([aside, 0.0, above])
            point = _first(field, nose_mm + way)
            if point is not None:
                seen[f"face {number}"] = point
        if len(seen) > len(found):
            found = seen
        if len(found) == len(AROUND_MM):
            break
    return found


def _first(
    field: Volume, through_mm: NDArray[np.float64]
) -> NDArray[np.float64] | None:
    """Look along a line from the front for the first tissue; None without any."""
    depths = np.arange(-REACH_MM, REACH_MM, STEP_MM)
    line = through_mm + depths[:, None] * np.array([0.0, 1.0, 0.0])
    height = field.sample(line)
    entered = np.flatnonzero((height[:-1] < 0) & (height[1:] >= 0))
    if not len(entered):
        return None
    i = int(entered[0])
    share = -height[i] / (height[i + 1] - height[i])
    point: NDArray[np.float64] = line[i] + share * (line[i + 1] - line[i])
    return point
