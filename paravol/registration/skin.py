"""The skin of the head as a surface that can be traced."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from renderers.scene import Volume

HALF_STEP_MM = 0.5
"""Of the central differences: a voxel, over which the field is smooth."""

FAR_MM = 12.0

# Raster over bridge and cheeks, patient LPS: x from side to side, one row per z. Below
# lie the nostrils, above the field ends.
ROWS_MM = (16.0, 26.0, 36.0, 48.0, 60.0)
SIDES_MM = (-32.0, 32.0)
COLUMN_MM = 2.0
FRONT_MM = (-22.0, 14.0)
LOOK_MM = 0.25


@dataclass(frozen=True, slots=True, eq=False)
class Skin:
    """Zero set of a signed air distance; see `surface_fit.Surface`.

    field: mm, negative in air. Outside the field there is no surface to be found.
    """

    field: Volume

    def distance(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return signed distances ``(n,)`` of points ``(n, 3)``."""
        open_air = self.field.with_values(self.field.values, -FAR_MM)
        return np.asarray(open_air.sample(points), dtype=np.float64)

    def normal(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the gradient ``(n, 3)`` of the distance, by central differences."""
        slopes = [
            self.distance(points + HALF_STEP_MM * way)
            - self.distance(points - HALF_STEP_MM * way)
            for way in np.eye(3)
        ]
        return np.stack(slopes, axis=1) / (2.0 * HALF_STEP_MM)

    def raster(self, dent_mm: float = 0.0) -> NDArray[np.float64]:
        """Return points ``(n, 3)`` of the face, row after row, to and fro.

        dent_mm: how far each is pressed in, along the skin's normal.
        """
        rows = []
        columns = np.arange(SIDES_MM[0], SIDES_MM[1] + COLUMN_MM / 2, COLUMN_MM)
        depths = np.arange(*FRONT_MM, LOOK_MM)
        for number, z in enumerate(ROWS_MM):
            found = [self._first(float(x), z, depths) for x in columns]
            row = [point for point in found if point is not None]
            rows += row if number % 2 == 0 else row[::-1]
        points = np.array(rows).reshape(-1, 3)
        inward = self.normal(points)
        inward /= np.linalg.norm(inward, axis=1, keepdims=True)
        return np.asarray(points + dent_mm * inward, dtype=np.float64)

    def _first(
        self, x: float, z: float, depths: NDArray[np.float64]
    ) -> NDArray[np.float64] | None:
        """Return the first point of the skin from the front, None without one."""
        line = np.stack([np.full_like(depths, x), depths, np.full_like(depths, z)], 1)
        height = self.distance(line)
        inside = np.flatnonzero((height[:-1] < 0.0) & (height[1:] >= 0.0))
        if not len(inside):
            return None
        i = int(inside[0])
        share = -height[i] / (height[i + 1] - height[i])
        point: NDArray[np.float64] = line[i] + share * (line[i + 1] - line[i])
        return point
