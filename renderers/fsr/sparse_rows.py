"""Slices of sparse rows: what remains of a grid when most voxels are left out.

The 1995 fuzzy set is ordered as its volume was: slices hold rows, a row is a sparse
vector of voxels. Rows are kept in compressed form, so that one row is one sorted
piece of `x` and can be clipped by binary search.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class SparseRows:
    """Where the elements of a set are on their grid.

    shape: grid size ``(nz, ny, nx)``. world_from_voxel: 4x4, (i, j, k) to mm.
    offsets: ``(nz * ny + 1,)`` int64; row ``(k, j)`` holds the elements
        ``offsets[k * ny + j] : offsets[k * ny + j + 1]``.
    x: ``(n,)`` uint16, the column of every element, increasing within a row.
    """

    shape: tuple[int, int, int]
    world_from_voxel: NDArray[np.float64]
    offsets: NDArray[np.int64]
    x: NDArray[np.uint16]

    def __post_init__(self) -> None:
        nz, ny, nx = self.shape
        if max(self.shape) > 65536:
            raise ValueError(
                f"a grid has at most 65536 voxels along an axis, got {nx} x {ny} x {nz}"
            )
        if self.offsets.shape != (nz * ny + 1,) or self.offsets[-1] != len(self.x):
            raise ValueError(
                f"{nz * ny} rows with {len(self.x)} elements do not fit offsets of "
                f"shape {self.offsets.shape}"
            )
        for array in (self.world_from_voxel, self.offsets, self.x):
            array.flags.writeable = False

    def __len__(self) -> int:
        return len(self.x)

    @property
    def row_count(self) -> int:
        """Return the number of rows that hold any element."""
        return int(np.count_nonzero(np.diff(self.offsets)))

    def voxels(self) -> NDArray[np.int64]:
        """Return ``(n, 3)`` grid coordinates (i, j, k) of all elements."""
        rows = np.repeat(np.arange(len(self.offsets) - 1), np.diff(self.offsets))
        ny = self.shape[1]
        return np.stack([self.x.astype(np.int64), rows % ny, rows // ny], axis=-1)

    def centers_mm(self) -> NDArray[np.float64]:
        """Return ``(n, 3)`` world positions of the elements' grid points."""
        matrix = self.world_from_voxel
        return self.voxels() @ matrix[:3, :3].T + matrix[:3, 3]
