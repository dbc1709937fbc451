"""Signed distances to the structures that must not be hurt."""

from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from anatomy.frame import lps_from_ras
from anatomy.kernels import evaluate_blocks as kernels
from anatomy.phantom.air import blocks_of, checked_points, distance_at_points
from anatomy.phantom.fixed_shapes import SHAPES
from anatomy.phantom.head import outside
from anatomy.phantom.model import Model, build_model
from anatomy.phantom.nose import septum_face
from anatomy.phantom.orbit import orbit
from anatomy.phantom.parameters import PhantomParameters
from anatomy.phantom.plates import skull_base
from anatomy.phantom.program import Encoder
from anatomy.phantom.shapes import Field, u, z
from anatomy.phantom.vessels import ethmoidal_arteries
from anatomy.tissue import Side

_STEP_MM = 0.25

EXACT = frozenset(
    (
        "optic nerve",
        "internal carotid",
        "ethmoidal arteries",
        "nasolacrimal duct",
        "sphenopalatine artery",
        "vidian nerve",
        "maxillary nerve",
    )
)
"""Tubes are exact distances; other values are divided by their gradient's norm."""

_ONE_FOR_BOTH = frozenset(("skull base",))
"""What is described by the distance from the midline, on either side of it."""


def hazard_fields(parameters: PhantomParameters, side: Side) -> dict[str, Field]:
    """List the structures of one side as fields, negative inside."""
    return {
        "orbit": orbit(parameters, side, outside()),
        "skull base": skull_base(parameters) - z,
        "optic nerve": SHAPES["optic nerve"],
        "internal carotid": SHAPES["internal carotid"],
        "ethmoidal arteries": ethmoidal_arteries(parameters, side),
        "nasolacrimal duct": SHAPES["nasolacrimal duct"],
        "sphenopalatine artery": SHAPES["sphenopalatine artery"],
        "vidian nerve": SHAPES["pterygoid canal"],
        "maxillary nerve": SHAPES["maxillary nerve"],
        "septum": abs(u) - septum_face(parameters, side),
    }


def hazard_distances(
    parameters: PhantomParameters, points_mm: NDArray[np.floating]
) -> dict[str, NDArray[np.float64]]:
    """Measure ``(..., 3)`` LPS points: signed distance in mm to each structure.

    Keys are a structure and its side, such as ``"optic nerve, left"``; values have the
    shape of the points without the last axis, negative inside. Vessels, nerve and duct
    are exact round tubes; orbit, skull base and septum are first order near their
    surfaces. Unevenness of the mucosa does not move them. Air is in none of them: there
    the distance is at least that to the air's boundary.
    """
    points = checked_points(points_mm)
    ras = lps_from_ras(points.reshape(-1, 3)) / parameters.head_scale
    # Where a structure and a sinus claim one place, the air has it, as in the volumes.
    depth = -distance_at_points(build_model(parameters), points)
    found = {}
    for side in (Side.RIGHT, Side.LEFT):
        for name in hazard_fields(parameters, side):
            value = _evaluate(parameters, side, name, ras).astype(np.float64)
            if name not in EXACT:
                square = np.zeros_like(value)
                for axis in range(3):
                    step = np.zeros(3)
                    step[axis] = _STEP_MM
                    ahead, behind = (
                        _evaluate(parameters, side, name, ras + s * step)
                        for s in (1.0, -1.0)
                    )
                    square += ((ahead - behind) / (2 * _STEP_MM)) ** 2
                value = value / np.sqrt(np.maximum(square, 0.05))
            distance = (parameters.head_scale * value).reshape(points.shape[:-1])
            distance = np.where(depth > 0, np.maximum(distance, depth), distance)
            found[f"{name}, {side.name.lower()}"] = distance
    return found


def hazard_values(
    parameters: PhantomParameters, side: Side, name: str, ras: NDArray[np.floating]
) -> NDArray[np.float32]:
    """Evaluate the field of one structure, mm, at ``(n, 3)`` RAS points of the head.

    A distance for the names in `EXACT`, else only its sign is one's.
    """
    scale = parameters.head_scale
    return np.float32(scale) * _evaluate(parameters, side, name, ras / scale)


@lru_cache(maxsize=4)
def _compiled(
    parameters: PhantomParameters, side: Side
) -> tuple[Model, dict[str, tuple[int, int]]]:
    """Put a side's structures in place of a head's programs."""
    model = build_model(parameters)
    encoder = Encoder()
    fields = hazard_fields(parameters, side)
    for field in fields.values():
        field.encode(encoder)
        encoder.finish_field()
    program = encoder.program()
    tables = model.tables._replace(code=program.code, constants=program.constants)
    spans = {
        name: (int(a), int(b))
        for name, (a, b) in zip(fields, program.spans, strict=True)
    }
    made = replace(model, tables=tables, stack_depth=program.depth)
    return made, spans


def _evaluate(
    parameters: PhantomParameters, side: Side, name: str, ras: NDArray[np.floating]
) -> NDArray[np.float32]:
    model, spans = _compiled(parameters, side)
    begin, end = spans[name]
    sign = np.float32(1.0 if side == Side.RIGHT else -1.0)
    if name in _ONE_FOR_BOTH:
        sign = np.float32(0.0)
    result = np.empty(len(ras), dtype=np.float32)
    for at, block, work, marks in blocks_of(model, ras):
        kernels.evaluate_span(
            block, model.tables, sign, begin, end, work, marks, result[at]
        )
    return result
