"""The uncinate process of one side: a sickle of thin bone, and the gutter behind it.

It stands in front of the bulla, nearly in a plane with the nose's length, its free edge
upwards and backwards. Between its lateral face and the orbit lies the infundibulum, a
slit; between the free edge and the bulla the hiatus semilunaris. Its upper end reaches
the lamina papyracea, the skull base or the middle turbinate; see
`PhantomParameters.uncinate_end`.
"""

from anatomy.phantom.ethmoid import lamina_papyracea
from anatomy.phantom.fixed_shapes import SHAPES
from anatomy.phantom.parameters import PhantomParameters
from anatomy.phantom.shapes import (
    Chain,
    Field,
    Point,
    depth_table,
    height_table,
    smooth_max,
    smooth_min,
    u,
    y,
    z,
)
from anatomy.tissue import Side

HALF_MM = 0.9
"""Half its thickness with the mucosa of both faces."""

WIDTH_MM = 4.9
"""From its attachment in front to its free edge."""

SLIT_MM = 1.9
"""Width of the infundibulum."""

LOW_MM, TOP_MM = 19.5, 36.5
"""Heights of its lower end and of the infundibulum's."""

DUCT_BONE_MM = 0.5
"""Of the nasolacrimal canal, towards the nose and the maxillary sinus."""

_ENDS = {
    "lamina": ((37.5, 10.9), (39.5, 12.8), (41.0, 13.8)),
    "cribriform": ((38.0, 9.2), (40.0, 7.9), (44.0, 5.8), (50.0, 4.9)),
    "skull-base": ((38.0, 9.4), (40.0, 8.4), (44.0, 7.0), (50.0, 6.6)),
    "turbinate": ((37.5, 9.0), (39.0, 7.4), (40.5, 6.0)),
}
"""Heights above the infundibulum, and how far lateral the process stands there."""


def upper_end(parameters: PhantomParameters, side: Side) -> str:
    """Return where the process ends above, a key of `_ENDS`."""
    for name in ("cribriform", "skull-base", "turbinate"):
        if parameters.has(f"uncinate-{name}", side):
            return name
    return "lamina"


def middle(parameters: PhantomParameters, side: Side) -> Field:
    """Return the lateral position of the middle of its plate."""
    heights, values = zip(*_ENDS[upper_end(parameters, side)], strict=True)
    course = height_table(
        [15, 18, 21, 24, 28, 32, 36, *heights],
        [13.2, 12.8, 12.0, 11.1, 10.3, 10.0, 10.0, *values],
        2.0,
    )
    # in front it comes off the side wall, and behind it the wall falls back
    return course + depth_table(
        [8, 11, 14, 17, 20, 26, 29, 31, 33],
        [3.0, 2.0, 1.0, 0.2, 0.0, 0.0, 0.5, 1.8, 2.8],
        2.0,
    )


def free_edge() -> Field:
    """Return the depth y of its free edge over the height."""
    return height_table(
        [15, 18, 20, 22.5, 25, 28, 32, 36, 40],
        [-31.6, -30.8, -29.8, -28.6, -27.2, -24.6, -22.8, -21.8, -21.2],
        2.0,
    )


def bulla_face() -> Field:
    """Return the depth y of the hiatus's rear wall, which is the bulla's face."""
    return height_table(
        [20, 24, 26, 28, 32, 36], [-31.0, -29.6, -28.2, -26.8, -24.9, -23.8], 2.0
    )


def process(parameters: PhantomParameters, side: Side) -> Field:
    """Build it as a solid in the cavity, its mucosa included."""
    edge = free_edge()
    plate = abs(u - middle(parameters, side)) - HALF_MM
    # surgery leaves its foot
    behind = edge + (WIDTH_MM - 1.0) if parameters.is_operated(side) else edge
    sickle = smooth_max(1.0, behind - y, y - edge - (WIDTH_MM + 1.0))
    top = 41.0 if upper_end(parameters, side) in ("lamina", "turbinate") else 52.0
    return smooth_max(0.9, plate, sickle, LOW_MM - z, z - top)


def infundibulum(parameters: PhantomParameters, side: Side) -> Field:
    """Build the gutter between process and orbit, with the hiatus behind its edge."""
    plate, face = middle(parameters, side), parameters.mucosa_mm + 0.5
    lateral = smooth_min(
        0.8,
        plate + (HALF_MM + SLIT_MM),
        lamina_papyracea(parameters, side) - face,
        13.1,
    )
    floor = depth_table([14, 16, 20, 24, 30], [28.0, 26.4, 24.4, 23.2, 22.6], 2.0)
    gutter = smooth_max(
        1.0,
        smooth_max(1.0, u - lateral, plate - (HALF_MM + 0.3) - u),
        smooth_max(1.0, y - free_edge() - WIDTH_MM, bulla_face() - y),
        smooth_max(1.5, floor - z, z - TOP_MM),
    )
    return smooth_max(0.7, gutter, -process(parameters, side))


def medial_slit(parameters: PhantomParameters, side: Side, turbinate: Field) -> Field:
    """Build the middle meatus between process and middle turbinate, up to the axilla.

    turbinate: lateral position of its lamella.
    """
    front = height_table([27, 30, 34, 37], [-10.0, -12.5, -14.5, -16.5], 2.0)
    return smooth_max(
        1.2,
        smooth_max(0.8, turbinate - u, u - middle(parameters, side) + (HALF_MM - 0.15)),
        smooth_max(1.5, y - front, bulla_face() - y),
        smooth_max(1.5, 24.0 - z, z - TOP_MM),
    )


def recess_end(parameters: PhantomParameters, side: Side) -> tuple[Point, Point]:
    """Return the lower end of the frontal recess: medial to the process, or behind it.

    Where the process ends at the lamina the recess opens beside it into the meatus;
    else into the infundibulum.
    """
    if upper_end(parameters, side) == "lamina":
        return (8.4, -18.0, 37.5), (8.0, -19.2, 34.5)
    return (10.6, -18.6, 37.5), (11.8, -19.6, 34.5)


def duct_wall() -> Field:
    """Return the depth below the bone of the nasolacrimal canal, above its opening."""
    duct = SHAPES["nasolacrimal duct"]
    assert isinstance(duct, Chain)
    return Chain(duct.points[:-1], duct.radii[:-1]) - DUCT_BONE_MM
