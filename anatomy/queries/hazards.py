"""Signed distances to the structures that must not be hurt, at points or on a grid."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from anatomy.frame import lps_from_ras
from anatomy.hazard_volumes import FARTHEST_MM, UNIT_MM, HazardVolumes
from anatomy.kernels import evaluate_blocks as kernels
from anatomy.phantom.air import blocks_of, checked_points, distance_at_points
from anatomy.phantom.ethmoid import ethmoidal_arteries
from anatomy.phantom.fixed_shapes import SHAPES
from anatomy.phantom.head import outside
from anatomy.phantom.model import Model, build_model
from anatomy.phantom.nose import septum_face
from anatomy.phantom.orbit import orbit
from anatomy.phantom.parameters import PhantomParameters
from anatomy.phantom.plates import skull_base
from anatomy.phantom.program import Encoder
from anatomy.phantom.shapes import Chain, Field, u, z
from anatomy.phantom.spread import MOST_MM
from anatomy.redistance import signed_distance
from anatomy.tissue import Side
from renderers.scene.volume import Volume

_STEP_MM = 0.25
_SIDES = Side.RIGHT, Side.LEFT

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
"""Tubes of an average head are exact distances; other values are divided by their
gradient's norm."""

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
    for side in _SIDES:
        for name in hazard_fields(parameters, side):
            value = _evaluate(parameters, side, name, ras).astype(np.float64)
            if name not in EXACT or parameters.spread_mm:
                square = np.zeros_like(value)
                for axis in range(3):
                    step = np.zeros(3)
                    step[axis] = _STEP_MM
                    ahead, behind = (
                        _evaluate(parameters, side, name, ras + s * step)
                        for s in (1.0, -1.0)
                    )
                    square += ((ahead - behind) / (2 * _STEP_MM)) ** 2
                norm = np.sqrt(np.maximum(square, 0.05))
                if name in EXACT:
                    # 1 but for the spread, and none on a tube's axis
                    norm[value < 0] = 1
                value = value / norm
            distance = (parameters.head_scale * value).reshape(points.shape[:-1])
            distance = np.where(depth > 0, np.maximum(distance, depth), distance)
            found[f"{name}, {side.name.lower()}"] = distance
    return found


def hazard_values(
    parameters: PhantomParameters, side: Side, name: str, ras: NDArray[np.floating]
) -> NDArray[np.float32]:
    """Evaluate the field of one structure, mm, at ``(n, 3)`` RAS points of the head.

    A distance for the names in `EXACT` where places are the average head's, else only
    its sign is one's.
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


BENT_MM = 8.0
"""A septum deviates by less: further out only the near side's structure counts."""


def sample_hazards(
    parameters: PhantomParameters, distance: Volume, threads: int = 1
) -> HazardVolumes:
    """Measure every voxel of a head's grid to the hazards of `hazard_distances`.

    distance: the head's signed air distance, whose grid is taken. Of both sides the
    nearer structure counts. Orbit, skull base and septum become true distances to
    their surfaces, where `hazard_distances` is first order. The result does not depend
    on `threads`.
    """
    spacing = float(distance.spacing_mm[0])
    axes = [
        (distance.origin_mm[a] + spacing * np.arange(n))
        for a, n in enumerate(distance.shape[::-1])
    ]
    air = -np.asarray(distance.values)

    def measure(name: str, field: Field) -> Volume:
        values = np.full(distance.shape, np.float32(1e3))
        for side in _SIDES:
            columns, rows, layers = _near(axes, side, field, parameters)
            size = 3, len(axes[1][rows]), len(axes[0][columns])
            ras = np.empty(size, np.float32)
            ras[0], ras[1] = -axes[0][columns], -axes[1][rows][:, None]
            for layer in range(layers.start, layers.stop):
                ras[2] = axes[2][layer]
                found = hazard_values(parameters, side, name, ras.reshape(3, -1).T)
                plane = values[layer, rows, columns]
                np.minimum(plane, found.reshape(plane.shape), out=plane)
        if name not in EXACT or parameters.spread_mm:
            values = signed_distance(values, spacing, FARTHEST_MM, FARTHEST_MM)
        # Where a structure and a sinus claim one place, the air has it.
        np.maximum(values, air, out=values, where=air > 0)
        np.clip(values, -FARTHEST_MM, FARTHEST_MM, out=values)
        steps = np.rint(values / np.float32(UNIT_MM)).astype(np.int16)
        return distance.with_values(steps, FARTHEST_MM / UNIT_MM)

    fields = hazard_fields(parameters, Side.RIGHT)
    with ThreadPoolExecutor(max_workers=threads) as pool:
        volumes = pool.map(measure, fields, fields.values())
        return HazardVolumes(dict(zip(fields, volumes, strict=True)))


def _near(
    axes: list[NDArray[np.float64]],
    side: Side,
    field: Field,
    parameters: PhantomParameters,
) -> tuple[slice, ...]:
    """Return the columns, rows and layers that a side's structure is near.

    axes: LPS x, y, z of the voxels. A tube has no distance to tell beyond
    `FARTHEST_MM`, the bent septum moves it by less than `BENT_MM`.
    """
    low, high = np.full(3, -np.inf), np.full(3, np.inf)
    if isinstance(field, Chain):
        head_scale = parameters.head_scale
        points = np.array(field.points) * head_scale
        room = FARTHEST_MM + head_scale * max(field.radii) + np.array([BENT_MM, 0, 0])
        room += 2 * head_scale * MOST_MM if parameters.spread_mm else 0
        low, high = points.min(axis=0) - room, points.max(axis=0) + room
    # LPS y points backwards, x to the patient's left.
    low[1], high[1] = -high[1], -low[1]
    low[0] = max(low[0], -BENT_MM)
    if side == Side.RIGHT:
        low[0], high[0] = -high[0], -low[0]
    return tuple(
        slice(
            int(np.searchsorted(axis, least)),
            int(np.searchsorted(axis, most, side="right")),
        )
        for axis, least, most in zip(axes, low, high, strict=True)
    )
