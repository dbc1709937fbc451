"""What lies behind the surface of the air: mucosa, a plate or shell of bone, ground.

A plate of 0.2 mm is thinner than a voxel, so no volume of labels can hold it. Here each
voxel only names the wall that it belongs to; the depth below the air's surface, which
is known to a fraction of a voxel, then tells the layer.
"""

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from renderers.scene.volume import Volume

NO_WALL = 0
"""Row of `WallLayers.kinds` for what belongs to no wall of an airway."""


class Layer(IntEnum):
    """Name what a place is made of, from the air inwards."""

    AIR = 0
    MUCOSA = 1
    BONE = 2
    GROUND = 3


@dataclass(frozen=True, slots=True)
class WallFeel:
    """How a wall feels under a tool, and where each figure is from.

    soft_n_mm, hard_n_mm: stiffness of its mucosa and of its bone, N/mm. friction:
    Coulomb's. damping_ns_mm: N s/mm. The sources are "guess", or who measured it; ""
    for what it has not.
    """

    soft_n_mm: float = 0.0
    hard_n_mm: float = 0.0
    friction: float = 0.0
    damping_ns_mm: float = 0.0
    soft_source: str = ""
    hard_source: str = ""
    friction_source: str = ""
    break_source: str = ""


NO_FEEL = WallFeel()
"""Of walls from before they said how they feel; see `anatomy.feel`."""


@dataclass(frozen=True, slots=True)
class WallKind:
    """Describe one kind of wall, from the air inwards.

    name: of its bone, such as ``"lamina papyracea"``; "" where it has none.
    mucosa_mm, bone_mm: thicknesses. mucosa, bone: their `Label`. fracture_n: axial
    force in newtons at which the bone breaks; 0 where it does not. behind: the
    structure that it protects, one of `HazardVolumes.names`, or "". feel: see
    `anatomy.feel.feel_of`.
    """

    name: str
    mucosa_mm: float
    bone_mm: float
    mucosa: int
    bone: int
    fracture_n: float = 0.0
    behind: str = ""
    feel: WallFeel = NO_FEEL


@dataclass(frozen=True, slots=True)
class WallLayers:
    """The walls of a head on the grid of its volumes.

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


@dataclass(frozen=True, slots=True)
class LayerSample:
    """What is at points; all arrays have the points' leading shape.

    depth_mm: distance to the pristine air surface, negative in air. layer: uint8
    `Layer`. label: uint8 `Label` of the tissue, 0 in air. wall: uint8 row of
    `WallLayers.kinds`.
    """

    depth_mm: NDArray[np.float64]
    layer: NDArray[np.uint8]
    label: NDArray[np.uint8]
    wall: NDArray[np.uint8]


def layer_at(
    layers: WallLayers, distance: Volume, points_mm: NDArray[np.float64]
) -> LayerSample:
    """Tell layer, tissue and wall at ``(..., 3)`` LPS points, mm.

    distance: the pristine air distance, negative in air; the depth is interpolated in
    it, in thin walls as `wall_depths` does. Wall and ground are those of the nearest
    voxel.
    """
    # Imported here: this module's names are needed where nothing is compiled.
    from anatomy.kernels.wall_depth import wall_depths

    points = np.asarray(points_mm, np.float64)
    depth = np.ascontiguousarray(distance.sample(points))
    matrix = distance.voxel_from_world
    voxels = points.reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3]
    wall_depths(distance.values, voxels, distance.spacing_mm, depth.reshape(-1))
    wall = layers.wall.nearest(points).astype(np.uint8)
    ground = layers.ground.nearest(points)
    mucosa_mm, bone_mm = np.moveaxis(layers.table()[wall], -1, 0)
    layer = np.where(depth < 0, Layer.AIR, Layer.MUCOSA)
    layer = np.where(depth >= mucosa_mm, Layer.BONE, layer)
    layer = np.where(depth >= mucosa_mm + bone_mm, Layer.GROUND, layer)
    layer = np.where(depth < 0, Layer.AIR, layer).astype(np.uint8)
    names = np.zeros((len(layers.kinds), 4), np.uint8)
    for row, kind in enumerate(layers.kinds):
        names[row, Layer.MUCOSA], names[row, Layer.BONE] = kind.mucosa, kind.bone
    label = np.where(layer == Layer.GROUND, ground, names[wall, layer])
    return LayerSample(depth, layer, label.astype(np.uint8), wall)
