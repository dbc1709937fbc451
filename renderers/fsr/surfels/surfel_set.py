"""Surface elements on the air boundary: the fuzzy set of mode `scope`.

An element of the grid is included when the zero of the signed distance passes
within half a spacing of it; it is then carried by ``-d`` along the gradient onto the
surface. The set has one layer everywhere, so that tangent discs of sigma
``0.6 * spacing`` cover it about ten times over.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from renderers.fsr.kernels.extract_surfels import extract_surfel_rows
from renderers.fsr.sobel_normals import flat_volume
from renderers.fsr.sparse_rows import SparseRows
from renderers.scene import Volume


@dataclass(frozen=True, slots=True)
class Surfels:
    """Hold points of the air surface in grid order.

    rows: where the elements sit on their (refined) grid.
    position: ``(n, 3)`` float32 mm, on the zero surface, along world axes from the
        grid's first point: float32 would lose microns far from the world's origin.
    normal: ``(n, 3)`` float32 unit, world, towards the air.
    spacing_mm: the largest spacing of the element grid, which sets disc sizes.
    """

    rows: SparseRows
    position: NDArray[np.float32]
    normal: NDArray[np.float32]
    spacing_mm: float

    def __len__(self) -> int:
        return len(self.rows)


def extract_surfels(distance: Volume, refine: int = 1) -> Surfels:
    """Find the surfels of a signed distance field (mm, negative in air).

    refine: elements per voxel and axis; 2 samples the trilinear field at half its
        spacing. Raises ValueError when `refine` is not positive.
    """
    if refine < 1:
        raise ValueError(f"refinement must be at least 1, got {refine}")
    volume = flat_volume(distance)
    nz, ny, nx = distance.shape
    shape = tuple((n - 1) * refine + 1 for n in (nz, ny, nx))
    world_from_voxel = distance.world_from_voxel
    offsets = np.zeros(shape[0] * shape[1] + 1, np.int64)
    size = max(16 * shape[2], int(4 * refine**2 * distance.values.size ** (2 / 3)))
    x = np.empty(size, np.uint16)
    position = np.empty((size, 3), np.float32)
    normal = np.empty((size, 3), np.float32)
    row = 0
    while row < shape[0] * shape[1]:
        row = extract_surfel_rows(
            volume,
            distance.spacing_mm,
            world_from_voxel,
            refine,
            row,
            offsets,
            x,
            position,
            normal,
        )
        if row < shape[0] * shape[1]:
            x, position, normal = (
                np.concatenate([a, np.empty_like(a)]) for a in (x, position, normal)
            )
    n = int(offsets[-1])
    grid = world_from_voxel.copy()
    grid[:3, :3] /= refine
    rows = SparseRows((shape[0], shape[1], shape[2]), grid, offsets, x[:n].copy())
    return Surfels(
        rows,
        position[:n].copy(),
        normal[:n].copy(),
        float(distance.spacing_mm.max()) / refine,
    )
