"""Surface elements on the air boundary: the fuzzy set of mode `scope`.

An element of the grid is included when the zero of the signed distance passes
within half a spacing of it; it is then carried by ``-d`` along the gradient onto the
surface. The set has one layer everywhere, so that tangent discs of sigma
``0.6 * spacing`` cover it about ten times over.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from renderers.fsr.kernels.extract_surfels import (
    FoundSurfels,
    GradientCache,
    SurfelQuery,
    extract_surfel_rows,
)
from renderers.fsr.kernels.gradients import FlatVolume
from renderers.fsr.sobel_normals import flat_volume
from renderers.fsr.sparse_rows import SparseRows
from renderers.scene import Volume

_PLANES = 8
"""Planes of gradients that are kept; surfels of one plane ask for six of them."""


def _none_far() -> NDArray[np.int64]:
    return np.empty((0, 4), np.int64)


@dataclass(frozen=True, slots=True)
class Surfels:
    """Points of the air surface in grid order.

    rows: where the elements sit on their (refined) grid.
    position: ``(n, 3)`` float32 mm, on the zero surface, along world axes from the
        grid's first point: float32 would lose microns far from the world's origin.
    normal: ``(n, 3)`` float32 unit, world, towards the air.
    spacing_mm: the largest spacing of the element grid, which sets disc sizes.
    far: ``(m, 4)`` int64, elements that depend on values far from them, see
        `FoundSurfels`.
    """

    rows: SparseRows
    position: NDArray[np.float32]
    normal: NDArray[np.float32]
    spacing_mm: float
    far: NDArray[np.int64] = field(default_factory=_none_far)

    def __len__(self) -> int:
        return len(self.rows)


def extract_surfels(distance: Volume, refine: int = 1) -> Surfels:
    """Find the surfels of a signed distance field (mm, negative in air).

    refine: elements per voxel and axis; 2 samples the trilinear field at half its
        spacing. Raises ValueError when `refine` is not positive.
    """
    if refine < 1:
        raise ValueError(f"refinement must be at least 1, got {refine}")
    nz, ny, nx = distance.shape
    shape = tuple((n - 1) * refine + 1 for n in (nz, ny, nx))
    world_from_voxel = distance.world_from_voxel
    offsets = np.zeros(shape[0] * shape[1] + 1, np.int64)
    size = max(16 * shape[2], int(4 * refine**2 * distance.values.size ** (2 / 3)))
    found = FoundSurfels(
        np.empty(size, np.uint16),
        np.empty((size, 3), np.float32),
        np.empty((size, 3), np.float32),
        np.empty((4 * shape[2], 4), np.int64),
    )
    cache = make_cache(_PLANES, (ny, nx), (0, 0))
    look = look_at(distance, flat_volume(distance), refine, cache)
    row = far = 0
    while row < shape[0] * shape[1]:
        row, far = extract_surfel_rows(look, row, offsets, found, far)
        if row < shape[0] * shape[1]:
            found = grown(found)
    n = int(offsets[-1])
    grid = world_from_voxel.copy()
    grid[:3, :3] /= refine
    rows = SparseRows((shape[0], shape[1], shape[2]), grid, offsets, found.x[:n].copy())
    return Surfels(
        rows,
        found.position[:n].copy(),
        found.normal[:n].copy(),
        float(distance.spacing_mm.max()) / refine,
        found.far[:far].copy(),
    )


def look_at(
    distance: Volume, volume: FlatVolume, refine: int, cache: GradientCache
) -> SurfelQuery:
    """Return where surfels are looked for; volume: the distance's."""
    x, y, z = distance.spacing_mm.tolist()
    world_from_voxel = distance.world_from_voxel
    direction = world_from_voxel[:3, :3] / distance.spacing_mm
    return SurfelQuery(volume, (x, y, z), world_from_voxel, direction, refine, cache)


def make_cache(
    planes: int, size: tuple[int, int], first: tuple[int, int]
) -> GradientCache:
    """Return an empty cache of so many planes; size: rows and columns of each.

    first: row and column of the volume in the first of them.
    """
    return GradientCache(
        np.empty((planes, *size, 3), np.float32),
        np.full((planes, *size), -1, np.int32),
        first[1],
        first[0],
    )


def grown(found: FoundSurfels) -> FoundSurfels:
    """Return the same with twice the room."""
    return FoundSurfels(*(np.concatenate([a, np.empty_like(a)]) for a in found))
