"""Distances to the structures that must not be hurt, sampled on a grid."""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from xxhash import xxh3_128_digest

from renderers.scene.volume import Volume

UNIT_MM = 0.01
"""Distances are stored as int16 in these steps."""

FARTHEST_MM = 25.0
"""Distances are clipped to this on either side."""


@dataclass(frozen=True, slots=True)
class HazardVolumes:
    """Hold the signed distance to each hazard, negative inside, on the head's grid.

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

    def along_mm(
        self,
        name: str,
        begin_mm: NDArray[np.float64],
        step_mm: NDArray[np.float64],
        count: int,
    ) -> float:
        """Return the least distance to a hazard of `count` points on a line, LPS mm."""
        # Imported here: this module's names are needed where nothing is compiled.
        from renderers.scene.kernels.least_along import least_along

        volume = self.volumes[name]
        matrix = volume.voxel_from_world
        start = matrix[:3, :3] @ begin_mm + matrix[:3, 3]
        step = matrix[:3, :3] @ step_mm
        far = volume.background
        _, steps = least_along(volume.values, 1.0, start, step, count, far)
        return UNIT_MM * steps

    def sha256(self) -> str:
        """Hash all distances and their grid."""
        digest = hashlib.sha256()
        for name, volume in sorted(self.volumes.items()):
            digest.update(f"{name} {volume.shape}".encode())
            digest.update(volume.world_from_voxel.tobytes())
            digest.update(xxh3_128_digest(volume.values.data))
        return digest.hexdigest()
