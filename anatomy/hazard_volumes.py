"""Distances to the structures that must not be hurt, sampled on a grid."""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from xxhash import xxh3_128_digest

from renderers.scene.volume import Volume

UNIT_MM = 0.01
"""Distances are stored as int16 in these steps."""

FARTHEST_MM = 25.0
"""Distances are clipped to this on either side."""


class HazardLine(NamedTuple):
    """Describe `points` places on a line, from one on by a step, LPS mm ``(3,)``."""

    begin_mm: NDArray[np.float64]
    step_mm: NDArray[np.float64]
    points: int


@dataclass(frozen=True)
class HazardVolumes:
    """The signed distance to each hazard, negative inside, on the head's grid.

    volumes: int16 in steps of `UNIT_MM`, by name: of both sides the nearer one.
    source: "phantom" or the file of labels that they were measured from.
    """

    volumes: Mapping[str, Volume]
    source: str = "phantom"

    @property
    def names(self) -> tuple[str, ...]:
        """Return the names of the hazards."""
        return tuple(self.volumes)

    def distance_mm(
        self, name: str, points_mm: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Interpolate the distance to one hazard at ``(..., 3)`` LPS points."""
        return self.volumes[name].sample(points_mm) * UNIT_MM

    @cached_property
    def nearest(self) -> Volume:
        """Return the distance to the nearest of all, in steps of `UNIT_MM`, int16.

        On the grid of the first; what lies beside another's grid is far from that.
        """
        first, *others = self.volumes.values()
        least = first.values.copy()
        for other in others:
            values = other.values
            if other.shape != first.shape or not np.array_equal(
                other.world_from_voxel, first.world_from_voxel
            ):
                values = _on_grid(other, first)
            np.minimum(least, values, out=least)
        return first.with_values(least, first.background)

    def along_mm(self, lines: Sequence[HazardLine]) -> list[dict[str, float]]:
        """Return each line's least distance of its points to each hazard, LPS mm."""
        # Imported here: this module's names are needed where nothing is compiled.
        from renderers.scene.kernels.least_along import least_along

        found: list[dict[str, float]] = [{} for _ in lines]
        for matrix, names in self._by_grid:
            for line, gaps in zip(lines, found, strict=True):
                start = matrix[:3, :3] @ line.begin_mm + matrix[:3, 3]
                step = matrix[:3, :3] @ line.step_mm
                for name in names:
                    volume = self.volumes[name]
                    far = volume.background
                    _, steps = least_along(
                        volume.values, 1.0, start, step, line.points, far
                    )
                    gaps[name] = UNIT_MM * steps
        return found

    @cached_property
    def _by_grid(self) -> list[tuple[NDArray[np.float64], list[str]]]:
        """Return the names of the hazards that share a transform of mm to voxels."""
        grids: list[tuple[NDArray[np.float64], list[str]]] = []
        for name, volume in self.volumes.items():
            matrix = volume.voxel_from_world
            same = [names for known, names in grids if np.array_equal(known, matrix)]
            if same:
                same[0].append(name)
            else:
                grids.append((matrix, [name]))
        return grids

    def sha256(self) -> str:
        """Hash all distances and their grid."""
        digest = hashlib.sha256()
        for name, volume in sorted(self.volumes.items()):
            digest.update(f"{name} {volume.shape}".encode())
            digest.update(volume.world_from_voxel.tobytes())
            digest.update(xxh3_128_digest(volume.values.data))
        return digest.hexdigest()


def _on_grid(volume: Volume, grid: Volume) -> NDArray[np.int16]:
    """Return a volume's values at the voxels of another's grid."""
    nz, ny, nx = grid.shape
    made = np.empty(grid.shape, np.int16)
    j, i = np.indices((ny, nx))
    matrix = grid.world_from_voxel
    for k in range(nz):
        voxels = np.stack([i, j, np.full_like(i, k)], axis=-1)
        made[k] = np.rint(volume.sample(voxels @ matrix[:3, :3].T + matrix[:3, 3]))
    return made
