"""A camera in terms of a set's grid."""

import itertools
import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderers.fsr.kernels.depth_sort import KEYS
from renderers.fsr.kernels.view_planes import see_grid
from renderers.fsr.sparse_rows import SparseRows
from renderers.scene import Camera, Projection

_CORNERS = np.array(list(itertools.product((0.0, 1.0), repeat=3))).T


@dataclass(frozen=True, slots=True)
class Grid:
    """Hold what does not depend on the camera.

    axes_mm: ``(3, 3)`` steps of i, j, k in columns. voxel_from_world: ``(3, 4)``. top:
    the last grid point. corners_mm: ``(3, 8)`` of the outermost voxels; middle_mm,
    radius_mm: the ball through them.
    """

    axes_mm: NDArray[np.float64]
    voxel_from_world: NDArray[np.float64]
    top: NDArray[np.float64]
    corners_mm: NDArray[np.float64]
    middle_mm: NDArray[np.float64]
    radius_mm: float

    @property
    def all_(self) -> tuple[Any, ...]:
        """Get what `see_grid` asks of a grid."""
        return (
            self.voxel_from_world,
            self.axes_mm,
            self.top,
            self.corners_mm,
            self.middle_mm,
            self.radius_mm,
        )


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


def grid_of(rows: SparseRows) -> Grid:
    """Find what every view of a set needs of its grid."""
    matrix = rows.world_from_voxel
    top = np.array(rows.shape[::-1]) - 1.0
    corners = _CORNERS * (top[:, None] + 1) - 0.5
    corners_mm = matrix[:3, :3] @ corners + matrix[:3, 3:]
    middle_mm = corners_mm.mean(axis=1)
    radius_mm = float(np.linalg.norm(corners_mm.T - middle_mm, axis=1).max())
    inverse = np.asarray(np.linalg.inv(matrix)[:3], np.float64)
    return Grid(matrix[:3, :3], inverse, top, corners_mm, middle_mm, radius_mm)


def view_of(camera: Camera, grid: Grid) -> View:
    """Find how a camera sees a set's grid."""
    is_flat = camera.projection is Projection.ORTHOGRAPHIC
    base, matrix, low, high = see_grid(camera.frame, is_flat, grid.all_)
    half = 0.5 * min(camera.width, camera.height)
    pinhole = camera.projection is Projection.PERSPECTIVE
    scale = half / (math.tan(camera.extent) if pinhole else camera.extent)
    return View(base, matrix, low, high, scale, is_flat)
