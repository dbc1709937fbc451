"""Frontal sinus of one side, cells that grow round it, and a second maxillary ostium.

Names of cells are those of the International Frontal Sinus Anatomy Classification
(Wormald et al., Int. Forum Allergy Rhinol. 6, 2016).
"""

import numpy as np

from anatomy.phantom.fixed_shapes import SHAPES
from anatomy.phantom.parameters import PhantomParameters
from anatomy.phantom.plates import FOVEA_MM, skull_base
from anatomy.phantom.program import Row
from anatomy.phantom.shapes import (
    Chain,
    Ellipsoid,
    Field,
    Mark,
    Point,
    Unevenness,
    smooth_max,
    smooth_min,
    u,
    z,
)
from anatomy.phantom.uncinate import recess_end
from anatomy.tissue import Side

SINUS_UNEVENNESS = 0.4
"""Share of the nose's unevenness on sinus walls: they are thin, and both their faces
move, so more of it would open holes towards the nose."""

SUPRAORBITAL_FLOOR_MM = 50.4


def accessory_ostium(parameters: PhantomParameters, side: Side) -> Chain:
    """Build the second ostium, through the membrane of the rear fontanelle."""
    _, y_mm, z_mm = accessory_place(parameters, side)
    ends = (11.5, y_mm + 0.3, z_mm - 0.3), (17.0, y_mm - 0.5, z_mm)
    return Chain(ends, (1.5, 1.5))


def accessory_place(parameters: PhantomParameters, side: Side) -> Point:
    """Return the middle of the accessory ostium; it keeps to the sinus's wall."""
    scale = parameters.scale("maxillary", side)
    return 13.6, -28.0 - 8.0 * scale, 25.0 - 5.0 * scale


def lining(body: Field) -> Mark:
    """Mark a sinus and make its walls slightly uneven."""
    return Mark(Row.SINUS, body + Unevenness(0, SINUS_UNEVENNESS))


def intersinus_lean(parameters: PhantomParameters) -> float:
    """Draw how far the septum between the frontal sinuses leans, mm at its top."""
    rng = np.random.default_rng([parameters.seed, 0x6672])
    return float(np.clip(rng.normal(0.0, 1.6), -3.5, 3.5))


def frontal(parameters: PhantomParameters, side: Side) -> Field | None:
    """Build the frontal sinus: lobes above the recess and over the orbit.

    The lobes' sizes are drawn, which scallops its upper margin; aplasia gives none.
    """
    q = parameters.scale("frontal", side)
    if q == 0:
        return None
    rng = np.random.default_rng([parameters.seed, int(side), 0x6672])
    tall, broad = np.clip(rng.normal(1.0, 0.06, 2), 0.88, 1.08)
    depth, high = q**0.5, q**0.6
    base = 56.0
    medial = Ellipsoid(
        (1.6 + 5.2 * q, -5.2, base + 8.6 * high),
        (6.9 * q, 6.3 * depth, 10.6 * high * tall),
    )
    lateral = Ellipsoid(
        (4.0 + 9.8 * q, -6.2, base + 6.6 * high),
        (9.2 * q * broad, 5.7 * depth, 7.1 * high),
    )
    crest = Ellipsoid(
        (3.0 + 7.6 * q, -4.6, base + 12.0 * high),
        (5.0 * q, 4.2 * depth, 6.0 * high),
    )
    lobes = smooth_min(1.4, medial, lateral, crest)
    # Its floor is the orbit's roof, which rises towards the side.
    lobes = smooth_max(2.0, lobes, (54.6 + (u - 8.0) * 0.22 - z) * 0.95)
    sign = 1.0 if side == Side.RIGHT else -1.0
    lean = sign * intersinus_lean(parameters) / 24.0
    septum = 0.9 + (z - base) * lean - u
    if parameters.has("frontal-septal-cell", side):
        wall = 2 * parameters.mucosa_mm + 0.3
        for name in ("septal cell", "septal cell outlet"):
            lobes = smooth_max(1.0, lobes, wall - SHAPES[name])
    return smooth_max(1.0, lobes, septum)


def frontal_recess(parameters: PhantomParameters, side: Side) -> Field:
    """Build the frontal recess with the ostium at its waist.

    A frontal septal cell pushes it sideways.
    """
    pushed = 0.7 if parameters.has("frontal-septal-cell", side) else 0.0
    return Chain(
        (
            (8.2 + pushed, -8.5, 59),
            (8.0, -11.5, 54.5),
            (7.8, -13.0, 48.5),
            (8.2, -15.5, 42.5),
            *recess_end(parameters, side),
        ),
        (3.4, 2.4, 2.3, 2.0, 1.7, 1.3),
    )


def supraorbital(parameters: PhantomParameters) -> Field:
    """Build the cell between the orbit's roof and the floor of the skull's front.

    It lies behind the frontal sinus; the bone above it is lifted for it, and the orbit
    lies under its floor.
    """
    roof = skull_base(parameters) - (parameters.mucosa_mm + FOVEA_MM)
    return smooth_max(1.2, SHAPES["supraorbital"], SUPRAORBITAL_FLOOR_MM - z, z - roof)


def supraorbital_outlet(parameters: PhantomParameters) -> Field:
    """Build the supraorbital cell's way to the rear of the frontal recess."""
    bend = 50.2 + 0.8 * parameters.roof_mm
    return Chain(
        ((15.8, -18.2, 52.0), (11.8, -16.8, bend), (8.2, -13.8, 47.8)), (1.1,) * 3
    )
