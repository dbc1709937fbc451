"""Ask the model about places, without building a volume."""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from anatomy.kernels.tables import Grids, Painted
from anatomy.kernels.wall_rows import NONE
from anatomy.phantom import air
from anatomy.phantom.coverage import UNCINATE_MM, paint
from anatomy.phantom.model import Model, build_model
from anatomy.phantom.parameters import PhantomParameters
from anatomy.phantom.program import Row
from anatomy.queries.hazards import hazard_distances
from anatomy.tissue import Label

_NO_PLATE = "", math.nan
_STEP_MM = 0.05
_model = lru_cache(maxsize=4)(build_model)


@dataclass(frozen=True, slots=True)
class TissueSample:
    """Hold what is at points; all arrays have the points' leading shape.

    distance_mm: signed distance to the air boundary, to first order, negative in air;
    normal: ``(..., 3)`` unit vectors towards the air. label: uint8 `Label`. hu: CT
    number after the scanner's blur, int16. bone_cover: share of bone, 0 to 1.
    hazard_mm, hazard: distance to the nearest critical structure, and its name.
    """

    distance_mm: NDArray[np.float64]
    normal: NDArray[np.float64]
    label: NDArray[np.uint8]
    hu: NDArray[np.int16]
    bone_cover: NDArray[np.float64]
    hazard_mm: NDArray[np.float64]
    hazard: NDArray[np.str_]


def tissue_at(
    parameters: PhantomParameters, points_mm: NDArray[np.floating]
) -> TissueSample:
    """Evaluate tissue, distance and hazards at ``(..., 3)`` LPS points in mm.

    Nothing depends on a grid: replay and checks of a volume ask here. Raise ValueError
    for points of another shape.
    """
    points = air.checked_points(points_mm)
    flat, shape = points.reshape(-1, 3), points.shape[:-1]
    model = _model(parameters)
    value, gradient = _first_order(model, flat)
    steepness = np.maximum(np.linalg.norm(gradient, axis=1), 0.3)
    distance = value / steepness
    grids = air.evaluate_at_points(model, flat)
    painted = _painted(model, grids, distance)
    hazards = hazard_distances(parameters, flat)
    names = np.array(list(hazards))
    table = np.array(list(hazards.values()))
    nearest = np.argmin(table, axis=0)
    return TissueSample(
        distance.reshape(shape),
        (-gradient / steepness[:, None]).reshape(points.shape),
        painted.labels.reshape(shape),
        painted.hu.reshape(shape),
        (painted.bone_cover.astype(np.float64) / 255).reshape(shape),
        table[nearest, np.arange(len(flat))].reshape(shape),
        names[nearest].reshape(shape),
    )


@dataclass(frozen=True, slots=True)
class PlateSample:
    """Hold which plate of bone walls are at points, in the points' leading shape.

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
    is no plate. Nothing depends on a grid. Raise ValueError for points of another
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


def _first_order(
    model: Model, points: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return values and central differences of the air function."""
    steps = _STEP_MM * np.concatenate([np.zeros((1, 3)), np.eye(3), -np.eye(3)])
    values = air.distance_at_points(model, points[:, None, :] + steps)
    gradient = (values[:, 1:4] - values[:, 4:7]) / (2 * _STEP_MM)
    return values[:, 0], gradient


def _painted(model: Model, grids: Grids, distance: NDArray[np.float64]) -> Painted:
    held = np.clip(distance, -12.0, 6.0).astype(np.float32).reshape(1, 1, -1)
    return paint(model, grids, held, 0.0, lambda work, total: work(0, total))
