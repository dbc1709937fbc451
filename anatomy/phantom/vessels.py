"""Vessels, nerves and ducts near the sinuses, as tubes of one side.

Their courses are radiological averages; the sphenoid sinus is moulded by them. The
foramen rotundum lies 19 mm from the midline (19.0 and 19.3 ± 2.1 mm; Mohebbi 2017, 100
people, doi 10.1016/j.bjorl.2016.04.013), above and lateral to the pterygoid canal,
whose length is 12.6 ± 2.6 mm (Chen and Xiao 2015, 334 canals).
"""

from anatomy.phantom.parameters import PhantomParameters
from anatomy.phantom.shapes import Chain, Point
from anatomy.tissue import Side

OPTIC_RADIUS_MM = 2.2
CAROTID_RADIUS_MM = 2.5
CANAL_WALL_MM = 0.25
"""Bone between a sinus and the nerve or artery behind it: at the carotid 0.25 ± 0.16
mm, at the optic canal 0.27 ± 0.15 (Andrianakis 2021, 200 sides)."""

ETHMOID_ROOF_MM = 51.6
"""Height of the fovea at the anterior ethmoidal artery."""


def optic_nerve() -> Chain:
    """Build the optic nerve from the globe through its canal to the chiasm."""
    return Chain(
        (
            (29, -22, 38),
            (23, -36, 39.5),
            (17, -47, 42),
            (13.1, -59, 43.9),
            (8.5, -65, 46.6),
            (3.5, -73, 49.5),
        ),
        (OPTIC_RADIUS_MM,) * 6,
    )


def internal_carotid() -> Chain:
    """Build the internal carotid's siphon along the sphenoid's side wall.

    Out of the petrous bone it climbs beside the clivus, runs forwards beside the sella
    and turns back under the optic nerve.
    """
    return Chain(
        (
            (29, -90, 12),
            (17, -81, 13),
            (13.4, -79.5, 19),
            (12.7, -80.5, 29),
            (12.8, -77, 34),
            (12.5, -69, 36),
            (12.3, -66.6, 39),
            (12.0, -69.5, 43.5),
            (10.8, -74, 50),
        ),
        (CAROTID_RADIUS_MM,) * 9,
    )


def pterygoid_canal() -> Chain:
    """Build the vidian nerve in its canal from pterygopalatine fossa to carotid."""
    return Chain(
        ((14.8, -52.4, 23.2), (14.4, -59, 22.6), (13.8, -66.5, 21.6)), (1.0, 0.8, 1.0)
    )


ROTUNDUM: tuple[Point, ...] = ((21.0, -64.0, 30.8), (18.8, -54.0, 28.6))
INFRAORBITAL: tuple[Point, ...] = ((26.0, -34.0, 25.6), (27.0, -12.0, 22.0))
NERVE_RADIUS_MM = 1.3, 0.9
"""Of the maxillary nerve in the foramen rotundum and in the infraorbital canal."""


def foramen_rotundum() -> Chain:
    """Build the canal through the greater wing's root."""
    return Chain(ROTUNDUM, (NERVE_RADIUS_MM[0],) * 2)


def infraorbital_canal() -> Chain:
    """Build the canal in the orbit's floor, on the roof of the maxillary sinus."""
    return Chain(INFRAORBITAL, (NERVE_RADIUS_MM[1],) * 2)


def maxillary_nerve() -> Chain:
    """Build the nerve from the foramen rotundum to the infraorbital foramen."""
    wide, thin = NERVE_RADIUS_MM
    fossa: tuple[Point, ...] = ((18.2, -49, 29.5), (24.0, -41, 28.2))
    points = (*ROTUNDUM, *fossa, *INFRAORBITAL, (26.6, -7.5, 19.5))
    return Chain(points, (wide, wide, 1.1, thin, thin, thin, thin))


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


def nasolacrimal_duct() -> Chain:
    """Build the lacrimal sac and duct down to the inferior meatus."""
    return Chain(((12.6, -5.5, 38), (12, -7, 31), (12.5, -12, 7)), (2.3, 1.9, 1.3))


def sphenopalatine_artery() -> Chain:
    """Build the artery from its fossa through its foramen to the turbinate's tail.

    The foramen lies behind the ethmoid crest, at the end of the middle turbinate.
    """
    return Chain(
        (
            (27, -50, 17),
            (20.5, -48.5, 20),
            (16.5, -49.5, 22.5),
            (13.2, -50.3, 24),
            (10.5, -52, 23),
        ),
        (1.1, 1.1, 0.9, 0.8, 0.5),
    )
