"""A camera in terms of a set's grid."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from renderers.fsr.classic.ordering.kernels import KEYS
from renderers.fsr.sparse_rows import SparseRows
from renderers.scene import Camera, Projection


@dataclass(frozen=True, slots=True)
class View:
    """Hold a camera in terms of a grid.

    base: the grid point next to the eye; places are counted from it, so that near
    splats keep their digits. matrix: ``(3, 4)``, camera frame from steps away from it.
    low, high: depths (mm) of the grid's nearest and farthest points. scale: pixels
    per radian, tangent or mm. is_flat: depth is along the view axis.
    """

    base: NDArray[np.float32]
    matrix: NDArray[np.float32]
    low: float
    high: float
    scale: float
    is_flat: bool

    @property
    def keys_per_mm(self) -> float:
        """Get the scale from depth to the keys of the order."""
        return KEYS / max(self.high - self.low, 1e-9)


def view_of(camera: Camera, rows: SparseRows) -> View:
    """Find how a camera sees a set's grid."""
    world_from_voxel = rows.world_from_voxel
    axes = camera.frame[1:] @ world_from_voxel[:3, :3]
    start = camera.frame[1:] @ (world_from_voxel[:3, 3] - camera.eye_mm)
    top = np.array(rows.shape[::-1]) - 1.0
    base = np.clip(np.rint(np.linalg.solve(axes, -start)), 0, top)
    matrix = np.column_stack([axes, axes @ base + start])
    corners = np.array(np.meshgrid(*zip(-0.5 - np.zeros(3), top + 0.5, strict=True)))
    seen = axes @ corners.reshape(3, -1) + start[:, None]
    is_flat = camera.projection is Projection.ORTHOGRAPHIC
    if is_flat:
        low, high = float(seen[2].min()), float(seen[2].max())
    else:
        middle, reach = seen.mean(axis=1), np.ptp(seen, axis=1)
        low = max(float(np.linalg.norm(middle) - np.linalg.norm(reach) / 2), 0.0)
        high = float(np.linalg.norm(seen, axis=0).max())
    half = 0.5 * min(camera.width, camera.height)
    pinhole = camera.projection is Projection.PERSPECTIVE
    scale = half / (math.tan(camera.extent) if pinhole else camera.extent)
    single = base.astype(np.float32), matrix.astype(np.float32)
    return View(*single, low, high, scale, is_flat)
