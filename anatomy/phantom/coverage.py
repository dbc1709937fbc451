"""Mucosa, bone shell and background as a CT sees them: analytic coverage.

Thin walls are narrower than a voxel, so no voxel is bone or not bone. With the
scanner's blur and the voxel's box as one Gaussian of variance ``blur^2 + h^2 / 12``,
the share of each layer is a difference of normal distribution functions; the mass of
a wall then does not depend on the voxel.
"""

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from anatomy.kernels import paint_layers as kernels
from anatomy.kernels.evaluate_blocks import OUTSIDE_ROW, PHARYNX_ROW
from anatomy.kernels.tables import Grids, Painted, WallLayers
from anatomy.phantom.model import BAND_MM, Model
from anatomy.phantom.program import Row
from anatomy.tissue import TISSUES, Label

_BONY = (
    Label.THICK_BONE,
    Label.SEPTAL_BONE,
    Label.TURBINATE_BONE,
    Label.TEETH,
)
_DEHISCENT = {
    "dehiscent-carotid": Label.INTERNAL_CAROTID,
    "dehiscent-optic": Label.OPTIC_NERVE,
}
_SHELL_FREE = (
    Label.SKIN,
    Label.SEPTAL_CARTILAGE,
    Label.MUCOSA,
    Label.SEPTAL_BONE,
    Label.MUCUS,
    Label.INSPISSATED_MUCUS,
    Label.POLYP,
    # through its foramen the artery reaches the mucosa
    Label.SPHENOPALATINE_ARTERY,
)

UNCINATE_MM = 0.36

# mucosa mm, bone mm, air label, mucosa label, bone label
_STRUCTURES: dict[int, tuple[float, float, int, int, int]] = {
    Row.INFERIOR: (0.6, 0.0, Label.NASAL_AIR, Label.INFERIOR_TURBINATE, 0),
    Row.MIDDLE: (0.5, 0.0, Label.NASAL_AIR, Label.MIDDLE_TURBINATE, 0),
    Row.SUPERIOR: (0.4, 0.0, Label.NASAL_AIR, Label.SUPERIOR_TURBINATE, 0),
    Row.UNCINATE: (0.72, UNCINATE_MM, Label.NASAL_AIR, Label.UNCINATE, Label.UNCINATE),
    Row.POLYP: (0.3, 0.0, Label.NASAL_AIR, Label.POLYP, 0),
    Row.TORUS: (1.0, 0.0, Label.NASOPHARYNX_AIR, Label.MUCOSA, 0),
    PHARYNX_ROW: (2.0, 0.0, Label.NASOPHARYNX_AIR, Label.MUCOSA, 0),
    OUTSIDE_ROW: (1.5, 0.0, Label.OUTSIDE_AIR, Label.SKIN, 0),
}


def blur_mm(edge_blur_mm: float, spacing_mm: float) -> float:
    """Join the scanner's blur and the voxel's box into one standard deviation."""
    return math.sqrt(edge_blur_mm**2 + spacing_mm**2 / 12)


def weights(
    depth_mm: float, total_mm: float, mucosa_mm: float, bone_mm: float, blur: float
) -> NDArray[np.float64]:
    """Return the shares ``(4,)`` of air, mucosa, bone and ground in a wall.

    depth_mm: signed distance to the near air surface; total_mm: thickness up to air
    on the far side; blur: standard deviation in mm of `blur_mm`.
    """
    result = np.empty(4)
    kernels.layer_weights(depth_mm, total_mm, mucosa_mm, bone_mm, blur, result)
    return result


def layer_tables(model: Model) -> WallLayers:
    """List what lies behind the surface of each part, structure and plate."""
    part_layers = np.array(
        [
            [p.wall.mucosa_mm, p.wall.bone_mm, p.label, Label.MUCOSA, p.wall.bone_label]
            for p in model.parts
        ]
    )
    structure_layers = np.zeros((max(_STRUCTURES) + 1, 5))
    for row, layer in _STRUCTURES.items():
        structure_layers[row] = layer
    plate_layers = np.array([[p.thickness_mm, p.label] for p in model.plates])
    shell = np.zeros((max(len(model.parts), 1), 256), dtype=np.uint8)
    shell[:, list(_BONY)] = 2
    shell[:, list(_SHELL_FREE)] |= 1
    for k, part in enumerate(model.parts):
        for variant, bare in _DEHISCENT.items():
            if model.parameters.has(variant, part.side):
                shell[k, bare] |= 1
    return WallLayers(
        part_layers,
        structure_layers,
        PHARYNX_ROW,
        plate_layers,
        shell,
        np.array([TISSUES[n].hu for n in ("air", "mucosa", "thin bone")]),
    )


def paint(
    model: Model,
    grids: Grids,
    distance: NDArray[np.float32],
    spacing_mm: float,
    run: Callable[[Callable[[int, int], None], int], None],
) -> Painted:
    """Paint CT numbers, labels and bone cover over the whole grid.

    run: calls a function on ``(first, last)`` ranges that tile the number given, on
    as many threads as it likes.
    """
    layers = layer_tables(model)
    painted = Painted(
        np.empty(distance.shape, dtype=np.int16),
        np.empty(distance.shape, dtype=np.uint8),
        np.empty(distance.shape, dtype=np.uint8),
    )
    blur = blur_mm(model.parameters.edge_blur_mm, spacing_mm)

    def slices(first: int, last: int) -> None:
        kernels.paint_layers(
            first,
            last,
            blur,
            np.float32(BAND_MM * model.parameters.head_scale),
            distance,
            grids,
            layers,
            painted,
        )

    run(slices, distance.shape[0])
    return painted
