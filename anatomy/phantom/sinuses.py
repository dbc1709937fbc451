"""Frontal sinus of one side, and what drains into the middle meatus."""

import numpy as np

from anatomy.phantom.parameters import PhantomParameters
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
from anatomy.tissue import Side

SINUS_UNEVENNESS = 0.4
"""Share of the nose's unevenness on sinus walls: they are thin, and both their faces
move, so more of it would open holes towards the nose."""

SEPTAL_CELL: Point = (2.3, -5.8, 58.6)


def infundibulum() -> Chain:
    """Build the ethmoid infundibulum, the gutter behind the uncinate process."""
    return Chain(
        (
            (8.6, -18.5, 38),
            (11.2, -18.5, 33.5),
            (11.5, -22.5, 27.3),
            (11.4, -27.5, 23.8),
        ),
        (1.5, 1.4, 1.4, 1.6),
    )


def maxillary_ostium() -> Chain:
    """Build the natural ostium, lateral to the uncinate process."""
    return Chain(((11.4, -27.0, 24.0), (18.5, -28.5, 21.5)), (2.0, 2.2))


def hiatus() -> Field:
    """Build the hiatus semilunaris between infundibulum and middle meatus."""
    upper = Chain(
        ((11.4, -24.5, 26.2), (9, -27, 24.3), (7.9, -29, 23)), (1.3, 1.2, 1.5)
    )
    lower = Chain(
        ((11.4, -27.5, 23.8), (9.2, -30.5, 22), (8.4, -32, 21)), (1.6, 1.5, 1.6)
    )
    return smooth_min(0.8, upper, lower)


def agger_nasi() -> Field:
    """Build the agger nasi cell: a larger chamber and a smaller one behind it."""
    front = Ellipsoid((8.5, -7.6, 38.4), (2.8, 3.6, 4.9))
    rear = Ellipsoid((8.0, -10.6, 36.8), (2.1, 2.6, 3.4))
    return smooth_min(1.2, front, rear)


def agger_outlet() -> Field:
    """Build the agger nasi cell's outlet to the frontal recess."""
    return Chain(((8.4, -9.5, 39.5), (8.3, -16, 41.5)), (0.9, 0.9))


def concha() -> Field:
    """Build the air cell in the head of a pneumatized middle turbinate."""
    return Ellipsoid((6.5, -24.5, 25.2), (1.8, 5.6, 3.4))


def concha_outlet() -> Field:
    """Build the pneumatized turbinate's outlet to the middle meatus."""
    return Chain(((6.6, -26.0, 26.8), (9.0, -26.8, 27.0)), (0.8, 0.8))


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
        lobes = smooth_max(1.0, lobes, wall - septal_cell())
    return smooth_max(1.0, lobes, septum)


def septal_cell() -> Field:
    """Build the cell in the septum between the frontal sinuses, at its foot."""
    return Ellipsoid(SEPTAL_CELL, (1.7, 3.4, 5.0))


def septal_cell_outlet() -> Field:
    """Build the frontal septal cell's way to the medial side of the recess."""
    return Chain(
        ((2.8, -6.8, 55.8), (4.8, -10.0, 52.0), (7.7, -13.2, 48.2)), (1.0,) * 3
    )


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
            (8.6, -17.5, 38),
        ),
        (3.4, 2.4, 2.3, 2.0, 1.7),
    )
