"""Ask the model which plate of bone is at a place, without building a volume."""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from anatomy.kernels.wall_rows import NONE
from anatomy.phantom import air
from anatomy.phantom.coverage import UNCINATE_MM
from anatomy.phantom.model import build_model
from anatomy.phantom.parameters import PhantomParameters
from anatomy.phantom.program import Row
from anatomy.tissue import Label

_NO_PLATE = "", math.nan
_model = lru_cache(maxsize=4)(build_model)


@dataclass(frozen=True, slots=True)
class PlateSample:
    """Which plate of bone walls are at points, in the points' leading shape.

    name: such as ``"lateral lamella"``, empty where none is. thickness_mm: the plate's
    own, whatever a voxel's edge; NaN where none is.
    """

    name: NDArray[np.str_]
    thickness_mm: NDArray[np.float64]


def plate_at(
    parameters: PhantomParameters, points_mm: NDArray[np.floating]
) -> PlateSample:
    """Tell which thin plate lies behind the mucosa at ``(..., 3)`` LPS points, mm.

    A point belongs to the wall of the air nearest to it, up to `BAND_MM`; thick bone
    is no plate. Nothing depends on a grid. Raise UserError for points of another
    shape.
    """
    points = air.checked_points(points_mm)
    model = _model(parameters)
    grids = air.evaluate_at_points(model, points.reshape(-1, 3))
    plate, part, structure = (
        grid.ravel() for grid in (grids.plate, grids.part, grids.structure)
    )
    # The plates of walls, the uncinate's, those with a zone; last, none.
    kinds = [_plate_of(p.wall.bone_label, p.wall.bone_mm) for p in model.parts]
    kinds.append(_plate_of(Label.UNCINATE, UNCINATE_MM))
    kinds += [(p.name, p.thickness_mm) for p in model.plates]
    kinds.append(_NO_PLATE)
    parts = len(model.parts)
    kind = np.where(part == NONE, len(kinds) - 1, part.astype(np.int64))
    kind = np.where(structure < Row.UNCINATE, len(kinds) - 1, kind)
    kind = np.where(structure == Row.UNCINATE, parts, kind)
    kind = np.where((plate != NONE) & (part != NONE), parts + 1 + plate, kind)
    shape = points.shape[:-1]
    return PlateSample(
        np.array([name for name, _ in kinds])[kind].reshape(shape),
        np.array([mm for _, mm in kinds])[kind].reshape(shape),
    )


def _plate_of(label: Label, thickness_mm: float) -> tuple[str, float]:
    if label == Label.THICK_BONE:
        return _NO_PLATE
    return label.name.lower().replace("_", " "), thickness_mm
