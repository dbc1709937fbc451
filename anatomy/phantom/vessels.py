"""Vessels, nerves and ducts near the sinuses, as tubes of one side.

Their courses are radiological averages; the sphenoid sinus is moulded by them.
"""

from anatomy.phantom.parameters import PhantomParameters
from anatomy.phantom.shapes import Chain, Point
from anatomy.tissue import Side

OPTIC_RADIUS_MM = 2.2
CAROTID_RADIUS_MM = 2.5
CANAL_WALL_MM = 0.25
"""Bone between a sphenoid sinus and the optic nerve or carotid behind it."""

ETHMOID_ROOF_MM = 51.6
"""Height of the fovea at the anterior ethmoidal artery."""


def optic_nerve() -> Chain:
    """Build the optic nerve from the globe through its canal to the chiasm."""
    return Chain(
        ((29, -22, 38), (23, -36, 39.5), (17, -47, 42), (14, -60, 44), (5, -74, 48)),
        (OPTIC_RADIUS_MM,) * 5,
    )


def internal_carotid() -> Chain:
    """Build the internal carotid's way along the sphenoid's side wall."""
    return Chain(
        (
            (19.5, -84, 10),
            (19.5, -84, 20),
            (19, -79, 29),
            (17.5, -76, 36),
            (15.5, -68, 43),
            (13.5, -66, 47),
            (16, -72, 54),
        ),
        (CAROTID_RADIUS_MM,) * 7,
    )


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
    rear = ((5, -30, top + 1.5), (4.5, -36, top - 1.6), (15.5, -39, top - 2.6))
    points = (*front, *middle, *rear)
    return Chain(points, (0.5,) * len(points))


def nasolacrimal_duct() -> Chain:
    """Build the lacrimal sac and duct down to the inferior meatus."""
    return Chain(((12.6, -5.5, 38), (12, -7, 31), (12.5, -12, 7)), (2.3, 1.9, 1.3))


def sphenopalatine_artery() -> Chain:
    """Build the artery at its foramen behind the middle turbinate's tail."""
    return Chain(((17, -51, 23), (13.2, -50.3, 24), (10.5, -52, 23)), (0.8, 0.8, 0.5))
