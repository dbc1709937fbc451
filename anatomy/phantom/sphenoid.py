"""The sphenoid sinus of one side, moulded by the nerves and arteries about it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from anatomy.phantom.ethmoid import CANAL_WALL_MM
from anatomy.phantom.fixed_shapes import SHAPES
from anatomy.phantom.parameters import SPHENOID_KINDS, PhantomParameters
from anatomy.phantom.plates import skull_base
from anatomy.phantom.shapes import (
    Affine,
    Field,
    Point,
    Table,
    U,
    depth_table,
    height_table,
    smooth_max,
    smooth_min,
    u,
    y,
    z,
)
from anatomy.tissue import Side

FACE_MM = -54.9
"""Depth y of the sinus's front end."""

ROOF_BONE_MM = 0.6
"""Least bone of planum and sella over the sinus."""

ATTACHED_SHARE = 0.35
"""Share of heads whose septum runs to the wall over a carotid; a choice within the
published 30 to 40 %."""

RIDGE_SHARE, RIDGE_HALF_MM = 0.45, 0.5
"""Share of sinuses with an incomplete septum beside the one between them: on 207 CTs
there were 0.9 more septa to a head (1, 2, 3 and 4 septa in 41, 33, 22 and 4 %, PMID
20687360); and what mucosa adds to either face of it."""


def pneumatization(parameters: PhantomParameters, side: Side) -> str:
    """Name how far a side's sinus reaches back: conchal, presellar, sellar, postsellar.

    Presellar ends before the sella's front wall, sellar before its rear wall.
    """
    for name in SPHENOID_KINDS:
        if parameters.has(name, side):
            return name.removesuffix("-sphenoid")
    return "sellar"


def rear_mm(parameters: PhantomParameters, side: Side) -> float:
    """Return the depth y at which the sinus ends."""
    w = parameters.scale("sphenoid", side)
    depth = {
        "conchal": 5.6 + 1.8 * w,
        "presellar": 9.0 + 2.6 * w,
        "sellar": 4.2 + 16.8 * w,
        "postsellar": 21.0 + 7.0 * w,
    }
    return FACE_MM - depth[pneumatization(parameters, side)]


def septum_end_mm(parameters: PhantomParameters) -> float:
    """Draw how far the septum of the sphenoid leaves the midline behind, mm.

    Positive is to the right. In `ATTACHED_SHARE` of heads it ends at a carotid.
    """
    rng = np.random.default_rng([parameters.seed, 0x7370])
    near = float(np.clip(rng.normal(0.0, 1.8), -4.0, 4.0))
    if rng.random() < ATTACHED_SHARE:
        return float(np.copysign(rng.uniform(7.5, 9.0), near))
    return near


def septum(parameters: PhantomParameters, side: Side) -> Field:
    """Return the lateral position of the septum's face on one side.

    At the ostia it is in the middle; behind, it is bowed, and meets roof and floor off
    the line in which it crosses the height of the ostia.
    """
    sign = 1.0 if side == Side.RIGHT else -1.0
    shift = sign * septum_end_mm(parameters)
    rng = np.random.default_rng([parameters.seed, 0x7371])
    low, high = sign * np.clip(rng.normal(0.0, 1.6, 2), -2.6, 2.6)
    course = depth_table(
        [56, 60, 66, 77],
        [0.85, 0.85 + 0.1 * shift, 0.85 + 0.5 * shift, 0.85 + shift],
        3.0,
    )
    lean = height_table([25, 31, 37, 44], [float(low), 0.0, 0.0, float(high)], 3.0)
    return course + lean * depth_table([55, 63], [0.0, 1.0], 2.0)


def sphenoid_middle(parameters: PhantomParameters, side: Side) -> tuple[Point, float]:
    """Return a place (u, y, z) in the sinus's air and how far it is from walls.

    It is clear of the septum wherever that ends.
    """
    kind, w = pneumatization(parameters, side), parameters.scale("sphenoid", side)
    if kind == "conchal":
        return (4.6, -58.2, 34.3), 2.0
    depth = 0.45 * (rear_mm(parameters, side) - FACE_MM)
    return (7.4, FACE_MM + max(depth, -11.0), 33.0), 3.0 * w


def sphenoid_body(parameters: PhantomParameters, side: Side) -> Field:
    """Build the sinus without what presses into it: six blended walls and a recess.

    The septum leaves the midline towards the rear and the walls of either side are
    drawn for themselves, so the two sinuses differ.
    """
    shape = _shape(parameters, side)
    w, kind = parameters.scale("sphenoid", side), pneumatization(parameters, side)
    high = 0.68 if kind == "conchal" else w
    face = (
        sphenoid_face() - height_table([24, 30, 36], [3.6, 2.4, 1.7], 2.0)
    ) * Affine(0.9)
    level = depth_table([54, 66, 74, 82], [44.6, 44.6, 42.4, 37.0], 2.0)
    roof = 34.5 + (level - 34.5) * high
    floor: Field = depth_table([54, 66, 76, 84], [24.6, 23.6, 24.6, 27.0], 2.0)
    floor = 34.5 + (floor - 34.5) * high
    # The keel of the rostrum stands in the middle; aside it climbs over the canals.
    keel = np.array((0.8, -0.9, -0.8, 3.0)) + shape.floor
    floor = floor + Table(U, (0, 4, 9, 14), tuple(keel.tolist()), 3.0)
    # Under a large sinus lies the roof of the nasopharynx, uneven by a millimetre.
    vault = depth_table([54, 60, 66, 80], [24.6, 23.4, 22.0, 14.0], 2.0)
    arch = np.array((-0.6, 0.3, 0.2, -2.0)) + shape.roof
    roof = roof + Table(U, (1, 5, 9, 14), tuple(arch.tolist()), 3.0)
    body = smooth_max(6.5, smooth_max(1.0, floor - z, vault - z), z - roof)
    # Widest between optic nerve and carotid, where the recess between them is.
    depths = np.array((13.6, 15.6, 15.0, 14.8, 13.0)) + shape.along
    wide: Field = depth_table([55, 61, 67, 76, 84], depths.tolist(), 2.0)
    heights = np.array((-3.2, -0.6, 0.6, 0.6, -1.6)) + shape.up
    wide = wide + height_table([23, 28, 34, 40, 45], heights.tolist(), 2.5)
    wide = wide * Affine(0.75 if kind == "conchal" else 0.7 + 0.3 * w)
    # The rear wall follows the clivus and is rounder than it aside.
    rear = rear_mm(parameters, side) - y
    rear = rear + Table(U, (2, 7, 13), (shape.rear - 1.0, -1.5, 2.2), 4.0)
    body = smooth_max(6.5, body, smooth_max(8.0, u - wide, rear))
    if parameters.has("lateral-recess", side):
        body = smooth_min(3.5, body, SHAPES["sphenoid recess"])
    body = smooth_max(3.0, body, y * 0.9 - face)
    if shape.ridge is not None:
        body = smooth_max(1.5, body, RIDGE_HALF_MM - _ridge(shape.ridge, rear))
    return smooth_max(2.5, body, septum(parameters, side) - u)


@dataclass(frozen=True, slots=True)
class _Shape:
    """Tell how the walls of one sinus differ from the average ones, mm.

    along, up: of the side wall over depth and height. roof, floor: over u. rear: of
    the rear wall beside the septum. ridge: lateral position, slant and height of an
    incomplete septum on the rear wall, or None.
    """

    along: NDArray[np.float64]
    up: NDArray[np.float64]
    roof: NDArray[np.float64]
    floor: NDArray[np.float64]
    rear: float
    ridge: tuple[float, float, float] | None


def _shape(parameters: PhantomParameters, side: Side) -> _Shape:
    """Draw what makes one sinus unlike its fellow; the seed and the side decide."""
    rng = np.random.default_rng([parameters.seed, int(side), 0x7368])
    along, up = rng.uniform(-0.6, 0.6, 5), rng.uniform(-0.6, 0.6, 5)
    roof, floor = rng.uniform(-0.6, 0.6, 4), rng.uniform(-0.8, 0.8, 4)
    rear = float(rng.uniform(-0.8, 1.2))
    place, slant = float(rng.uniform(7.0, 10.0)), float(rng.uniform(-0.3, 0.3))
    depth = FACE_MM - rear_mm(parameters, side)
    ridge = place, slant, float(rng.uniform(0.12, 0.26)) * depth
    has_ridge = rng.random() < RIDGE_SHARE
    return _Shape(along, up, roof, floor, rear, ridge if has_ridge else None)


def _ridge(of: tuple[float, float, float], rear: Field) -> Field:
    """Build an incomplete septum on the rear wall, lower in the middle of its course.

    rear: the distance behind the rear wall's surface.
    """
    place, slant, height = of
    line = u - place - (z - 34.0) * Affine(slant)
    crest = height_table([26, 34, 43], [height + 1.5, height - 1.5, height + 1.0], 3.0)
    return smooth_max(1.0, abs(line) - 0.3, -rear - crest)


def canal_walls(parameters: PhantomParameters, side: Side) -> tuple[Field, ...]:
    """List what keeps the sinus off nerves, arteries, brain and an Onodi cell.

    Each is negative where a sinus may be: beyond the structure's bone and mucosa.
    """
    lining = parameters.mucosa_mm
    walls: list[Field] = [
        wall_over(parameters, side, "dehiscent-optic") - SHAPES["optic nerve"],
        wall_over(parameters, side, "dehiscent-carotid") - SHAPES["internal carotid"],
        CANAL_WALL_MM + lining - SHAPES["pterygoid canal"],
        CANAL_WALL_MM + lining - SHAPES["maxillary nerve"],
        # The sella's side is steep: half the slope keeps this close to a distance.
        (z - skull_base(parameters) + (ROOF_BONE_MM + lining)) * Affine(0.5),
    ]
    if parameters.has("onodi", side):
        walls.append(2 * lining + 0.3 - SHAPES["onodi"])
    return tuple(walls)


def wall_over(parameters: PhantomParameters, side: Side, dehiscence: str) -> float:
    """Return bone and mucosa over a canal, mm; no bone where it is dehiscent."""
    bone = 0.0 if parameters.has(dehiscence, side) else CANAL_WALL_MM
    return bone + parameters.mucosa_mm


def sphenoid(parameters: PhantomParameters, side: Side) -> Field:
    """Build the sphenoid sinus: its walls, less what presses into it."""
    body = sphenoid_body(parameters, side)
    return smooth_max(0.8, body, *canal_walls(parameters, side))


def onodi(parameters: PhantomParameters, side: Side) -> Field:
    """Build the Onodi cell, indented by the optic nerve."""
    wall = wall_over(parameters, side, "dehiscent-optic")
    return smooth_max(0.8, SHAPES["onodi"], wall - SHAPES["optic nerve"])


def sphenoid_face() -> Field:
    """Return the depth y of the wall between nose and sphenoid over the height."""
    return height_table(
        [16, 20, 22.5, 25, 44, 80], [-60, -59, -56.6, -53.6, -52, -47], 1.0
    )
