"""A camera in terms of a set's grid."""

import itertools
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from renderers.fsr.classic.ordering.kernels import KEYS
from renderers.fsr.sparse_rows import SparseRows
from renderers.scene import Camera, Projection

_CORNERS = np.array(list(itertools.product((0.0, 1.0), repeat=3))).T


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
    seen = axes @ (_CORNERS * (top[:, None] + 1) - 0.5) + start[:, None]
    is_flat = camera.projection is Projection.ORTHOGRAPHIC
    if is_flat:
        low, high = float(seen[2].min()), float(seen[2].max())
    else:
        middle = axes @ (top / 2) + start
        reach = seen.max(axis=1) - seen.min(axis=1)
        low = max(math.hypot(*middle) - math.hypot(*reach) / 2, 0.0)
        high = math.sqrt(float((seen * seen).sum(axis=0).max()))
    half = 0.5 * min(camera.width, camera.height)
    pinhole = camera.projection is Projection.PERSPECTIVE
    scale = half / (math.tan(camera.extent) if pinhole else camera.extent)
    single = base.astype(np.float32), matrix.astype(np.float32)
    return View(*single, low, high, scale, is_flat)
