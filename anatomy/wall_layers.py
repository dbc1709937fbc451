"""What lies behind the surface of the air: mucosa, a plate or shell of bone, ground.

A plate of 0.2 mm is thinner than a voxel, so no volume of labels can hold it. Here each
voxel only names the wall that it belongs to; the depth below the air's surface, which
is known to a fraction of a voxel, then tells the layer.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from renderers.scene.volume import Volume

NO_WALL = 0
"""Row of `WallLayers.kinds` for what belongs to no wall of an airway."""


@dataclass(frozen=True, slots=True)
class WallKind:
    """Describe one kind of wall, from the air inwards.

    name: of its bone, such as ``"lamina papyracea"``; "" where it has none.
    mucosa_mm, bone_mm: thicknesses. mucosa, bone: their `Label`. fracture_n: axial
    force in newtons at which the bone breaks; 0 where it does not. behind: the
    structure that it protects, one of `HazardVolumes.names`, or "".
    """

    name: str
    mucosa_mm: float
    bone_mm: float
    mucosa: int
    bone: int
    fracture_n: float = 0.0
    behind: str = ""


@dataclass(frozen=True, slots=True)
class WallLayers:
    """Hold the walls of a head on the grid of its volumes.

    wall: uint8, row of `kinds`; row `NO_WALL` is no wall: all ground. ground: uint8
    `Label` of what lies beyond mucosa and bone. depth of a place is its pristine air
    distance: up to ``mucosa_mm`` it is mucosa, then ``bone_mm`` of bone, then ground.
    source: "phantom", or how the layers were found. uncertainty_mm: standard
    deviation of the layers' places.
    """

    wall: Volume
    ground: Volume
    kinds: tuple[WallKind, ...]
    source: str = "phantom"
    uncertainty_mm: float = 0.0

    def table(self) -> NDArray[np.float32]:
        """Return ``(256, 2)`` float32 thicknesses of mucosa and bone by row, mm."""
        table = np.zeros((256, 2), np.float32)
        for row, kind in enumerate(self.kinds):
            table[row] = kind.mucosa_mm, kind.bone_mm
        return table
