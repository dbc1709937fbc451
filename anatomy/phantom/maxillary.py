"""The maxillary sinus of one side: a pyramid with recesses, roots and a ridge."""

import math
from dataclasses import dataclass

import numpy as np

from anatomy.phantom.ethmoid import ethmoid_block
from anatomy.phantom.fixed_shapes import SHAPES
from anatomy.phantom.parameters import PhantomParameters
from anatomy.phantom.shapes import (
    Chain,
    Ellipsoid,
    Field,
    Point,
    height_table,
    smooth_max,
    smooth_min,
    u,
    y,
    z,
)
from anatomy.tissue import Side

MEDIAL_MM = 14.6
"""Lateral distance of the base, the wall to the nose; a larger sinus keeps it."""

_CENTER: Point = (MEDIAL_MM, -28.0, 25.0)
"""The sinus is scaled about this place, beside its ostium."""

_ROOTS: tuple[Point, ...] = (
    (18.6, -20.5, -9.0),
    (22.6, -25.0, -6.4),
    (18.4, -28.5, -6.4),
    (23.4, -32.0, -6.2),
    (19.6, -36.0, -6.4),
)
"""Apices of premolar and molars on the average: buccal and palatal in turn. Of molar
roots 41 % reach into the sinus (342 roots, doi 10.1186/s43055-021-00540-y, at the upper
end of published figures), of premolars few."""

_SEPTUM_SHARE, _HANGING_SHARE = 0.28, 0.12
"""Shares of sides with a septum on the floor, and with the infraorbital canal away from
the roof; published figures run from 16 to 58 % and from 8 to 28 % (recalled)."""


@dataclass(frozen=True, slots=True)
class SinusShape:
    """Tell how one sinus differs from the average one, mm.

    front, rear, roof: how far out the walls stand. zygomatic, alveolar, prelacrimal:
    added depth of the recesses. roots: added height of each apex. septum: depth y and
    height of a septum on the floor, height 0 for none. hanging: how far the
    infraorbital canal lies below the roof.
    """

    front: float
    rear: float
    roof: float
    zygomatic: float
    alveolar: float
    prelacrimal: float
    roots: tuple[float, ...]
    septum: tuple[float, float]
    hanging: float


def sinus_shape(parameters: PhantomParameters, side: Side) -> SinusShape:
    """Draw what makes one sinus unlike its fellow; the seed and the side decide."""
    rng = np.random.default_rng([parameters.seed, int(side), 0x6D78])
    spread = np.clip(rng.normal(0.0, 1.0, 6), -2.0, 2.0)
    front, rear, roof, zygomatic, alveolar, prelacrimal = (
        float(v) for v in spread * (1.0, 1.2, 0.4, 1.3, 1.3, 1.2)
    )
    roots = tuple(float(v) for v in np.clip(rng.normal(0.0, 1.2, len(_ROOTS)), -2, 2.4))
    place, height = float(rng.uniform(-33.0, -23.0)), float(rng.uniform(4.0, 8.0))
    septum = place, height if rng.random() < _SEPTUM_SHARE else 0.0
    hanging = float(rng.uniform(1.5, 3.0)) if rng.random() < _HANGING_SHARE else 0.0
    return SinusShape(
        front, rear, roof, zygomatic, alveolar, prelacrimal, roots, septum, hanging
    )


def molar_roots(parameters: PhantomParameters, side: Side) -> tuple[Point, ...]:
    """List the apices of the roots under one sinus; some stand in its floor."""
    lift = sinus_shape(parameters, side).roots
    return tuple((a, b, c + up) for (a, b, c), up in zip(_ROOTS, lift, strict=True))


def maxillary(parameters: PhantomParameters, side: Side) -> Field:
    """Build the sinus: base at the nose, apex in the zygoma, recesses at its corners.

    Front and rear walls meet towards the side, the roof is the orbit's floor with the
    ridge of the infraorbital canal, and the floor rises to the zygoma.
    """
    scale = parameters.scale("maxillary", side)
    shape = sinus_shape(parameters, side)

    def scaled(axis: Field, center: float) -> Field:
        return (axis - center) * (1 / scale) + center

    def place(a: float, b: float, c: float) -> Point:
        p, q, r = _CENTER
        return p + scale * (a - p), q + scale * (b - q), r + scale * (c - r)

    def recess(center: Point, radii: Point) -> Field:
        a, b, c = radii
        return Ellipsoid(place(*center), (scale * a, scale * b, scale * c))

    su, sy, sz = (scaled(a, c) for a, c in zip((u, y, z), _CENTER, strict=True))
    # Below, the nose's side wall bulges outwards over the inferior meatus.
    bulge = height_table([-6, 2, 9, 15], [2.0, 0.8, 0.6, 0.0], 2.0)
    body = smooth_max(4.0, bulge + MEDIAL_MM - su, su - (MEDIAL_MM + 25.2))
    # Seen from the side it is narrower below than at the orbit.
    taper = smooth_max(6.0, (9.0 - sz) * 0.22, 0.0)
    front = (sy + (7.6 - shape.front) + (su - MEDIAL_MM) * 0.56 + taper) * 0.85
    rear = (-(49.0 + shape.rear) + (su - MEDIAL_MM) * 0.50 - sy + taper) * 0.87
    body = smooth_max(5.0, body, smooth_max(7.0, front, rear))
    dome = (su - 15.0) * (su - 15.0) * 0.01
    roof = (sz - (26.5 + shape.roof) + dome) * 0.87
    rise = ((su - 25.0) * 0.66 - (sz + 4.0) * 0.75) * 1.0
    body = smooth_max(4.5, body, smooth_max(4.0, -4.6 - sz, rise), roof)
    body = body * scale
    for center, radii in (
        ((35.5, -25.5, 13.5), (4.6 + shape.zygomatic, 5.0, 5.6)),
        ((20.5, -29.5, -3.4), (3.6, 9.5, 3.2 + shape.alveolar)),
        ((18.2, -12.4, 11.0), (2.8, 3.4 + shape.prelacrimal, 6.5)),
    ):
        body = smooth_min(3.0, body, recess(center, radii))
    low = shape.hanging
    canal = Chain(
        ((24.5, -41, 26.4), (26.5, -26, 25.2 - low), (27.5, -13, 21.8 - low)),
        (1.4, 1.7, 1.6),
    )
    body = smooth_max(1.5, body, 0.4 - canal)
    depth, height = shape.septum
    if height > 0.0:
        top = place(0.0, 0.0, -7.0)[2] + height
        ridge = smooth_max(1.5, abs(y - depth + (u - 22.0) * 0.25) - 0.3, z - top)
        body = smooth_max(1.2, body, 0.5 - ridge)
    for a, b, c in molar_roots(parameters, side):
        body = smooth_max(1.5, body, 0.5 - Chain(((a, b, c), (a, b, c - 9)), (1, 2.2)))
    # The ethmoid comes first where both want to be.
    wall = 2 * parameters.mucosa_mm + 0.7
    body = smooth_max(0.8, body, wall - ethmoid_block(parameters, side))
    if parameters.has("haller", side):
        body = smooth_max(0.8, body, wall - SHAPES["haller"])
    return body


ANTROSTOMY_FRONT_MM, ANTROSTOMY_TOP_MM, ANTROSTOMY_HALF_MM = -23.2, 25.2, 4.6
"""Front and upper edge of an antrostomy, behind the nasolacrimal duct and under the
orbit's floor, and half its greatest height, over the inferior turbinate."""

WINDOW_MM = 13.8
"""Lateral distance at which an antrostomy has the area asked for."""


def antrostomy(area_mm2: float) -> Field:
    """Build the opening that surgery leaves: an ellipse in the fontanelles, drawn out.

    It holds the natural ostium and grows backwards.
    """
    high = min(ANTROSTOMY_HALF_MM, math.sqrt(area_mm2 / (1.4 * math.pi)))
    long = area_mm2 / (math.pi * high)
    center = WINDOW_MM, ANTROSTOMY_FRONT_MM - long, ANTROSTOMY_TOP_MM - high
    return smooth_max(0.5, Ellipsoid(center, (16.0, long, high)), abs(u - 13.6) - 4.6)
