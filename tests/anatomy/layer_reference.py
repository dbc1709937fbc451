"""What a cut must find by the layer model: the phantom's functions, sampled densely.

Nothing of the stored volumes is used: parts, plates and grounds are evaluated on a
lattice of `FINE_MM`, and the depth is a distance of that lattice.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from anatomy.hazard_volumes import HazardVolumes
from anatomy.phantom import air
from anatomy.phantom.lattice import Lattice
from anatomy.phantom.model import build_model
from anatomy.phantom.parameters import PhantomParameters
from anatomy.phantom.walls import wall_layers
from anatomy.redistance import FARTHEST_MM, redistance
from anatomy.wall_layers import Layer, LayerSample, WallLayers, layer_at
from renderers.scene import Volume

FINE_MM = 0.1
MARGIN_MM = 2.5
"""Of the lattice round the cut: air farther away decides nothing that is cut."""


@dataclass(frozen=True, slots=True)
class LayerVolumes:
    """Cubic millimetres inside a solid: by layer, and of bone by wall."""

    tissue_mm3: float
    mucosa_mm3: float
    bone_mm3: dict[str, float]
    ground_mm3: float

    @property
    def all_bone_mm3(self) -> float:
        """Return the bone of all walls."""
        return sum(self.bone_mm3.values())


def fine_layers(
    parameters: PhantomParameters,
    low_mm: NDArray[np.float64],
    high_mm: NDArray[np.float64],
) -> tuple[WallLayers, Volume]:
    """Return the walls and the air distance of a box, LPS, on the fine lattice."""
    model = build_model(parameters)
    first = np.floor((low_mm - MARGIN_MM) / FINE_MM).astype(int)
    last = np.ceil((high_mm + MARGIN_MM) / FINE_MM).astype(int)
    count = last - first + 1
    lattice = Lattice(FINE_MM, tuple(first.tolist()), tuple(count.tolist()))
    grids, _ = air.evaluate_lattice(model, lattice, air.default_threads())
    distance = Volume(
        redistance(grids.air, FINE_MM),
        np.full(3, FINE_MM),
        lattice.origin_mm,
        background=FARTHEST_MM,
    )
    return wall_layers(model, grids, distance, HazardVolumes({})), distance


def layer_volumes(
    parameters: PhantomParameters,
    from_mm: NDArray[np.float64],
    to_mm: NDArray[np.float64],
    radius_mm: float,
) -> LayerVolumes:
    """Return what a capsule, or a ball where both ends are one place, holds."""
    begin, end = np.asarray(from_mm, float), np.asarray(to_mm, float)
    low, high = np.minimum(begin, end) - radius_mm, np.maximum(begin, end) + radius_mm
    layers, distance = fine_layers(parameters, low, high)
    axes = [
        distance.origin_mm[a] + FINE_MM * np.arange(n)
        for a, n in enumerate(distance.shape[::-1])
    ]
    z, y, x = np.meshgrid(*axes[::-1], indexing="ij")
    points = np.stack([x, y, z], axis=-1)
    along = end - begin
    square = float(along @ along)
    t = np.zeros(x.shape)
    if square > 0.0:
        t = np.clip((points - begin) @ along / square, 0.0, 1.0)
    off = np.linalg.norm(points - begin - t[..., None] * along, axis=-1)
    inside = points[off <= radius_mm]
    found: LayerSample = layer_at(layers, distance, inside)
    voxel = FINE_MM**3
    bone = found.wall[found.layer == Layer.BONE]
    by_wall: dict[str, float] = {}
    for row, count in enumerate(np.bincount(bone, minlength=len(layers.kinds))):
        if count:
            name = layers.kinds[row].name
            by_wall[name] = by_wall.get(name, 0.0) + float(count) * voxel
    return LayerVolumes(
        float(np.count_nonzero(found.layer != Layer.AIR)) * voxel,
        float(np.count_nonzero(found.layer == Layer.MUCOSA)) * voxel,
        by_wall,
        float(np.count_nonzero(found.layer == Layer.GROUND)) * voxel,
    )
