"""Scalars on a regular grid in the patient's frame.

Arrays are indexed ``[z, y, x]``, C order, x fastest: what SimpleITK returns and
what VTK wants without a copy. This is the only place that decides it.

World frame: patient LPS, millimetres (x towards the patient's left, y towards the
back, z upwards). Voxel frame: ``(i, j, k)`` counted along x, y, z of the *array*;
integer coordinates are voxel centres, and the interpolable box reaches from the
first centre to the last.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderers.scene.kernels.sample_volume import interpolate
from renderers.scene.memory_limit import memory_limit
from system import UserError

AIR_HU = -1000.0
"""Value of everything outside a CT volume."""

COMPILED = "bBhHiIlLqQfd"
"""Types of numbers, by numpy's letters, that compiled code reads as they are."""

WIDEST_RATIO = 1e4
"""Between the largest and the smallest spacing; beyond it a unit is wrong."""

_RIGID_TOLERANCE = 1e-6
"""Largest departure of direction cosines from an orthonormal matrix. Image headers
carry six decimals, so 1e-6 is what a correct file can be off by."""


@dataclass(frozen=True, slots=True)
class Volume:
    """Scalars on a grid, their spacing, origin and direction.

    values: ``(nz, ny, nx)`` any real dtype, made C-contiguous and read-only. The array
        given stays its owner's; whoever edits it later edits this volume.
    spacing_mm, origin_mm: ``(3,)`` in x, y, z order; origin is the centre of voxel 0.
    direction: ``(3, 3)`` columns are the world directions of the array's x, y, z axes.
    background: value taken to fill the world outside the grid.
    """

    values: NDArray[Any]
    spacing_mm: NDArray[np.float64]
    origin_mm: NDArray[np.float64]
    direction: NDArray[np.float64] = field(default_factory=lambda: np.eye(3))
    background: float = AIR_HU
    _voxel_from_world: NDArray[np.float64] = field(
        init=False, repr=False, compare=False
    )

    def __post_init__(self) -> None:
        values = np.asarray(self.values)
        if not values.flags.c_contiguous and values.nbytes > memory_limit():
            raise UserError(
                f"a volume of shape {values.shape} needs {values.nbytes:,} bytes in C "
                f"order and at most {memory_limit():,} may be taken; give it in that "
                "order, as np.load(..., mmap_mode='r') does of a file"
            )
        values = np.ascontiguousarray(values)
        if values.ndim != 3 or min(values.shape) < 2:
            raise UserError(
                f"a volume needs three axes of at least 2 voxels, got shape "
                f"{values.shape}"
            )
        if values.dtype.kind not in "iuf":
            raise UserError(f"a volume holds real numbers, got dtype {values.dtype}")
        spacing = np.array(self.spacing_mm, dtype=np.float64)
        origin = np.array(self.origin_mm, dtype=np.float64)
        direction = np.array(self.direction, dtype=np.float64)
        if spacing.shape != (3,) or not np.all(np.isfinite(spacing) & (spacing > 0)):
            raise UserError(
                f"spacing must be three positive millimetre values, got {spacing}; a "
                "flipped axis is told by the direction"
            )
        if spacing.max() > WIDEST_RATIO * spacing.min():
            raise UserError(
                f"spacing of {spacing} mm has a ratio beyond {WIDEST_RATIO:g}; one of "
                "the numbers is in another unit"
            )
        if origin.shape != (3,) or not np.all(np.isfinite(origin)):
            raise UserError(f"origin must be three finite millimetre values: {origin}")
        if direction.shape != (3, 3) or not np.allclose(
            direction.T @ direction, np.eye(3), atol=_RIGID_TOLERANCE
        ):
            raise UserError(f"direction must be an orthonormal 3x3 matrix: {direction}")
        if values.flags.writeable:
            values = values.view()
            values.flags.writeable = False
        linear = (direction / spacing).T
        voxel_from_world = np.eye(4)
        voxel_from_world[:3, :3] = linear
        voxel_from_world[:3, 3] = -linear @ origin
        for name, array in (
            ("values", values),
            ("spacing_mm", spacing),
            ("origin_mm", origin),
            ("direction", direction),
            ("_voxel_from_world", voxel_from_world),
        ):
            array.flags.writeable = False
            object.__setattr__(self, name, array)

    @property
    def shape(self) -> tuple[int, int, int]:
        """Return the array shape ``(nz, ny, nx)``."""
        nz, ny, nx = self.values.shape
        return nz, ny, nx

    @property
    def world_from_voxel(self) -> NDArray[np.float64]:
        """Return the 4x4 transform from ``(i, j, k)`` (x, y, z order) to world mm."""
        matrix = np.eye(4)
        matrix[:3, :3] = self.direction * self.spacing_mm
        matrix[:3, 3] = self.origin_mm
        return matrix

    @property
    def voxel_from_world(self) -> NDArray[np.float64]:
        """Return the 4x4 transform from world mm to voxel coordinates, read-only."""
        return self._voxel_from_world

    @property
    def center_mm(self) -> NDArray[np.float64]:
        """Return the world position of the grid's centre."""
        middle = (np.array(self.shape[::-1]) - 1) / 2
        return self.origin_mm + self.direction @ (middle * self.spacing_mm)

    @property
    def value_range(self) -> tuple[float, float]:
        """Return the smallest and largest value."""
        return float(self.values.min()), float(self.values.max())

    def sample(self, points_mm: NDArray[np.float64]) -> NDArray[np.float64]:
        """Interpolate trilinearly at ``(..., 3)`` world points, in float64.

        Outside the interpolable box the background is returned. Kernels do their own
        interpolation.
        """
        points = np.asarray(points_mm, dtype=np.float64)
        matrix = self.voxel_from_world
        voxel = points @ matrix[:3, :3].T + matrix[:3, 3]
        found = np.empty(points.shape[:-1])
        voxels = np.ascontiguousarray(voxel.reshape(-1, 3))
        values = self.values
        if not values.dtype.isnative or values.dtype.char not in COMPILED:
            values = values.astype(np.float64)
        interpolate(values, voxels, self.background, found.reshape(-1))
        return found

    def nearest(
        self, points_mm: NDArray[np.float64], outside: float | None = None
    ) -> NDArray[Any]:
        """Return the values of the voxels nearest to ``(..., 3)`` world points.

        outside: for what is off the grid, the background if None. It need be no number
        of the values' type: the type returned holds both.
        """
        matrix = self.voxel_from_world
        index = np.rint(points_mm @ matrix[:3, :3].T + matrix[:3, 3]).astype(np.intp)
        top = np.array(self.shape[::-1]) - 1
        inside = np.all((index >= 0) & (index <= top), axis=-1)
        i, j, k = np.moveaxis(np.clip(index, 0, top), -1, 0)
        off = self.background if outside is None else outside
        # an array, not a number: numpy fits a number into the values' type, or refuses
        return np.where(inside, self.values[k, j, i], np.asarray(off))

    def at_voxel(self, voxel: NDArray[np.float64]) -> float:
        """Interpolate as `sample` does, at one place ``(3,)`` in voxels.

        In plain numbers: numpy takes ten times as long for one.
        """
        nz, ny, nx = self.shape
        x, y, z = voxel.tolist()
        if not (0 <= x <= nx - 1 and 0 <= y <= ny - 1 and 0 <= z <= nz - 1):
            return self.background
        i, j, k = min(int(x), nx - 2), min(int(y), ny - 2), min(int(z), nz - 2)
        fx, fy, fz = x - i, y - j, z - k
        cell = self.values[k : k + 2, j : j + 2, i : i + 2].tolist()
        (a, b), (c, d) = (
            [row[0] + fx * (row[1] - row[0]) for row in layer] for layer in cell
        )
        front, back = a + fy * (b - a), c + fy * (d - c)
        return float(front + fz * (back - front))

    def at_nearest(self, place_mm: Sequence[float], outside: float) -> Any:
        """Return what `nearest` does at one place, in plain numbers."""
        x, y, z = place_mm
        index = []
        rows = self.voxel_from_world[:3].tolist()
        for (a, b, c, d), size in zip(rows, self.shape[::-1], strict=True):
            at = a * x + b * y + c * z + d
            # what is no number lies off the grid, too
            if not -1.0 < at < size or not 0 <= round(at) < size:
                return outside
            index.append(round(at))
        return self.values[tuple(index[::-1])]

    def with_values(self, values: NDArray[Any], background: float) -> "Volume":
        """Return the same grid holding other values of the same shape."""
        if values.shape != self.values.shape:
            raise UserError(
                f"values of shape {values.shape} do not fit the grid {self.shape}"
            )
        return Volume(
            values, self.spacing_mm, self.origin_mm, self.direction, background
        )
