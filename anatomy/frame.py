"""The step from the anatomical tables' frame to the world."""

import numpy as np
from numpy.typing import NDArray


def lps_from_ras(points: NDArray[np.floating]) -> NDArray[np.float64]:
    """Convert ``(..., 3)`` points or vectors from RAS to LPS; its own inverse.

    RAS counts x to the patient's right, y to the front, z up, with the origin at the
    tip of the anterior nasal spine; LPS, the world, x to the left, y to the back.
    """
    flipped: NDArray[np.float64] = np.array(points, dtype=np.float64)
    flipped[..., :2] *= -1.0
    return flipped
