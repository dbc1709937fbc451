"""Planes around a view, in the world and in float64."""

import numpy as np
from numpy.typing import NDArray

from renderers.fsr.view_bounds import lens_planes
from renderers.scene import Camera


def view_planes(camera: Camera, margin_mm: float) -> NDArray[np.float64]:
    """Bound the view, moved out by a margin, by world planes ``(p, 4)``."""
    lens = lens_planes(camera.projection, camera.extent, camera.width, camera.height)
    normals = lens[:, :3] @ camera.frame[1:]
    return np.column_stack([normals, lens[:, 3] + margin_mm - normals @ camera.eye_mm])
