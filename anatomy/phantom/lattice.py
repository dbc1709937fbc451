"""The voxels of one phantom: a box of the lattice ``index * spacing``."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from system import UserError

Box = tuple[tuple[float, float], tuple[float, float], tuple[float, float]]

DEFAULT_FIELD_MM: Box = ((-41.0, 41.0), (-23.0, 80.0), (-12.0, 78.0))
"""LPS x, y, z ranges that hold the nose and all sinuses, 6.2 million voxels at 0.5."""


def field_for(head_scale: float, frontal_scale: float, rear_mm: float = 0.0) -> Box:
    """Choose the field of view for a head's size; frontal sinuses may be tall.

    rear_mm: how far behind the anterior nasal spine the sphenoid sinuses end.
    """
    top = max(78.0, 57.5 + 21.0 * frontal_scale**0.6)
    x, y, (bottom, _) = DEFAULT_FIELD_MM
    k = max(head_scale, 1.0)
    return (
        (k * x[0], k * x[1]),
        (k * y[0], k * max(y[1], rear_mm + 2.0)),
        (k * bottom, k * top),
    )


@dataclass(frozen=True, slots=True)
class Lattice:
    """The first index and the number of voxels along LPS x, y and z.

    Coordinates are whole multiples of the spacing, so any two fields of view of equal
    spacing share their voxels, bit for bit.
    """

    spacing_mm: float
    first: tuple[int, int, int]
    count: tuple[int, int, int]

    @classmethod
    def covering(cls, spacing_mm: float, field_mm: Box) -> "Lattice":
        """Choose the lattice points inside a box."""
        if not 0.2 <= spacing_mm <= 3.0:
            raise UserError(
                f"the phantom's spacing must lie in [0.2, 3] mm, got {spacing_mm}"
            )
        tolerance = 1e-9
        first = [int(np.ceil(a / spacing_mm - tolerance)) for a, _ in field_mm]
        last = [int(np.floor(b / spacing_mm + tolerance)) for _, b in field_mm]
        count = [b - a + 1 for a, b in zip(first, last, strict=True)]
        if min(count) < 2:
            raise UserError(
                f"the field of view {field_mm} mm holds fewer than two voxels of "
                f"{spacing_mm} mm along an axis"
            )
        return cls(
            spacing_mm, (first[0], first[1], first[2]), (count[0], count[1], count[2])
        )

    @property
    def shape(self) -> tuple[int, int, int]:
        """Return the array shape ``(nz, ny, nx)``."""
        return self.count[2], self.count[1], self.count[0]

    @property
    def origin_mm(self) -> NDArray[np.float64]:
        """Return the world position of voxel 0."""
        return np.array(self.first, dtype=np.float64) * self.spacing_mm

    @property
    def ras_start(self) -> NDArray[np.int64]:
        """Return the lattice index of voxel 0 in RAS, where x and y run backwards."""
        return np.array([-self.first[0], -self.first[1], self.first[2]], dtype=np.int64)
