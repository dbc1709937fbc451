"""Balls and shells in a cube of 20 mm, as distances and as a scan would store them."""

import numpy as np
from numpy.typing import NDArray

from renderers.scene import Volume


def distances(radius_mm: float, spacing_mm: float) -> NDArray[np.float64]:
    """Measure from the sphere's surface, positive inside, in a cube of 20 mm."""
    n = round(20 / spacing_mm) + 1
    axis = (np.arange(n) - (n - 1) / 2) * spacing_mm
    r = np.sqrt(axis[:, None, None] ** 2 + axis[:, None] ** 2 + axis**2)
    return np.asarray(radius_mm - r)


def hounsfield(distance_mm: NDArray[np.float64], spacing_mm: float) -> Volume:
    """Store distances as 200 HU a millimetre, clipped to 1000."""
    values = np.clip(np.rint(200 * distance_mm), -1000, 1000).astype(np.int16)
    return Volume(values, np.full(3, spacing_mm), np.full(3, -10.0))
