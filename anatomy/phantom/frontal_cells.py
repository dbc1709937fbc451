"""Ethmoid cells that grow round the frontal sinus: over the orbit, into its septum.

Names are those of the International Frontal Sinus Anatomy Classification (Wormald et
al., Int. Forum Allergy Rhinol. 6, 2016). Each drains into the frontal recess.
"""

from anatomy.phantom.parameters import PhantomParameters
from anatomy.phantom.plates import FOVEA_MM, skull_base
from anatomy.phantom.shapes import Chain, Ellipsoid, Field, Point, smooth_max, z

SUPRAORBITAL: Point = (18.4, -18.6, 52.9)
FLOOR_MM = 50.4


def supraorbital(parameters: PhantomParameters) -> Field:
    """Build the cell between the orbit's roof and the floor of the skull's front.

    It lies behind the frontal sinus; the bone above it is lifted for it, and the orbit
    lies under its floor.
    """
    roof = skull_base(parameters) - (parameters.mucosa_mm + FOVEA_MM)
    body = Ellipsoid(SUPRAORBITAL, (6.0, 5.2, 4.6))
    return smooth_max(1.2, body, FLOOR_MM - z, z - roof)


def supraorbital_outlet(parameters: PhantomParameters) -> Field:
    """Build the supraorbital cell's way to the rear of the frontal recess."""
    bend = 50.2 + 0.8 * parameters.roof_mm
    return Chain(
        ((15.8, -18.2, 52.0), (11.8, -16.8, bend), (8.2, -13.8, 47.8)), (1.1,) * 3
    )
