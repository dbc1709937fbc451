"""Vessels and canals whose courses differ, or that are walled off from a sinus."""

from anatomy.phantom.fixed_shapes import course
from anatomy.phantom.parameters import PhantomParameters
from anatomy.phantom.shapes import Chain, Point
from anatomy.tissue import Side

CANAL_WALL_MM = 0.25
"""Bone between a sinus and the nerve or artery behind it: at the carotid 0.25 ± 0.16
mm, at the optic canal 0.27 ± 0.15 (Andrianakis 2021, 200 sides)."""

ETHMOID_ROOF_MM = 51.6
"""Height of the fovea at the anterior ethmoidal artery."""


def ethmoidal_arteries(parameters: PhantomParameters, side: Side) -> Chain:
    """Build the anterior and posterior ethmoidal arteries.

    They cross the roof from the orbit to the olfactory fossa; one that hangs lies
    3 mm below the roof in a bony mesentery.
    """
    drop = 3.0 if parameters.has("hanging-artery", side) else 0.0
    top = ETHMOID_ROOF_MM + parameters.roof_mm
    front = ((16.5, -27, top - 1.5 - drop), (9, -24, top - 0.2 - drop))
    middle: tuple[Point, ...] = ((4.5, -22, top - 1.0),)
    # The way back lies inside the skull: the two arteries are one chain.
    rear = ((5, -30, top + 1.5), (4.5, -36, top - 1.6), (15.5, -38.6, top - 2.6))
    points = (*front, *middle, *rear)
    return Chain(points, (0.5,) * len(points))


def maxillary_canals() -> tuple[Chain, Chain]:
    """Build the maxillary nerve's canals: foramen rotundum, infraorbital canal."""
    nerve = course("maxillary nerve")
    return (
        Chain(nerve.points[:2], nerve.radii[:2]),
        Chain(nerve.points[4:6], nerve.radii[4:6]),
    )
