"""Where a place lies in the picture, and where the shaft of a scope goes."""

import numpy as np
from numpy.typing import NDArray

from renderers.scene import Camera

ASIDE_DEG = 3.0
"""Nearer to the middle of the picture than this, the middle itself is the place."""


def shaft_heading(
    camera: Camera, world_from_tip: NDArray[np.float64]
) -> tuple[float, float] | None:
    """Return the place in the picture that the tip moves to when the shaft goes in.

    As shares of width and height, (0, 0) in the upper left corner; out of 0 to 1 where
    the scope looks so far aside that the place is not in view. A scope goes along its
    shaft, not along its view: whoever keeps the goal in the middle of a picture of 30
    degrees passes by it. None for a straight scope.
    """
    shaft = -world_from_tip[:3, 2]
    if not float(shaft @ camera.frame[3]) < np.cos(np.radians(ASIDE_DEG)):
        return None
    # a point so far away that it lies where all lines along the shaft meet
    return place_in_picture(camera, camera.frame[0] + 1e6 * shaft)


def place_in_picture(
    camera: Camera, place_mm: NDArray[np.float64] | None
) -> tuple[float, float] | None:
    """Return where a place, (3,), lies as shares of width and height, as above.

    None for none, and for one that is not finite.
    """
    if place_mm is None or not np.all(np.isfinite(place_mm)):
        return None
    (column, row), _ = camera.project(place_mm)
    return float(column) / camera.width, float(row) / camera.height
