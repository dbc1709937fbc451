"""The skull base and other thin plates of bone: where each is, and its thickness.

A plate of 0.1 mm is a fifth of a voxel: no set of voxels can say how thick it is. The
number belongs to the plate. It lies behind the mucosa of the air beside it, and the
scan shows it by coverage.
"""

from dataclasses import dataclass

from anatomy.phantom.ethmoid import (
    FOVEA_BONE_MM,
    basal_lamella,
    by_side,
    ethmoid_block,
    ethmoid_roof,
    fovea,
    keros_depth,
    lamina_papyracea,
    medial_wall,
)
from anatomy.phantom.fixed_shapes import SHAPES
from anatomy.phantom.parameters import PhantomParameters
from anatomy.phantom.program import Row
from anatomy.phantom.shapes import (
    Affine,
    Field,
    Recall,
    Table,
    U,
    depth_table,
    one_side,
    smooth_max,
    smooth_min,
    u,
    y,
    z,
)
from anatomy.tissue import Label, Side

FOVEA_MM = FOVEA_BONE_MM
CRIBRIFORM_MM = 0.15
LATERAL_LAMELLA_MM = 0.1
"""Middles of the ranges: cribriform plate 0.1 to 0.2, lateral lamella 0.05 to 0.2."""

UNDER_MM = 2.2
"""Air this far below the skull base still has it for a roof."""

OVER_MM = 8.0
"""Above this the skull is its vault again."""

CLEFT_MM = 5.0
"""No roof of the olfactory cleft lies higher above its middle height."""

FRONT_MM, REAR_MM = -13.0, -53.5
"""Depths y between which ethmoid and olfactory cleft bear the skull base."""


LAMINA_SHARE = 0.85
"""Thickness of the lamina papyracea beside that of walls between cells. Figures for it
are 0.2 to 0.4 mm; this share brings its CT numbers near those of a real scan."""


@dataclass(frozen=True, slots=True)
class Plate:
    """Name a plate of bone. zone: negative where the walls of air are this plate."""

    name: str
    thickness_mm: float
    label: Label
    zone: Field


def plates(parameters: PhantomParameters) -> tuple[Plate, ...]:
    """List the plates; where zones overlap, the later one counts."""
    lamina, lamella, gaps = [], [], []
    for side, sign in ((Side.RIGHT, 1.0), (Side.LEFT, -1.0)):
        wall = lamina_papyracea(parameters, side)
        block = ethmoid_block(parameters, side)
        # before the cells the infundibulum lies beside it, as far as the lacrimal bone
        front = smooth_max(0.0, y + 13.0, -28.0 - y, 27.0 - z, z - 42.0)
        beside = smooth_min(0.0, block - 2.0, front)
        sheet = smooth_max(0.0, abs(u - wall) - 2.0, beside)
        lamina.append(one_side(sheet, sign))
        if parameters.has("dehiscent-lamina", side):
            hole = smooth_max(0.0, sheet, SHAPES["lamina gap"])
            gaps.append(one_side(hole, sign))
        parting = smooth_max(
            0.0, abs(y - basal_lamella(parameters, side)) - 0.9, block - 0.2
        )
        lamella.append(one_side(parting, sign))
    thin = parameters.cell_bone_mm
    dehiscent = Plate(
        "dehiscent lamina",
        0.0,
        Label.LAMINA_PAPYRACEA,
        smooth_min(0.0, *gaps or (1e3,)),
    )
    return (
        Plate("basal lamella", thin, Label.BASAL_LAMELLA, smooth_min(0.0, *lamella)),
        Plate(
            "lamina papyracea",
            LAMINA_SHARE * thin,
            Label.LAMINA_PAPYRACEA,
            smooth_min(0.0, *lamina),
        ),
        *([dehiscent] if gaps else []),
        Plate("fovea ethmoidalis", FOVEA_MM, Label.FOVEA, fovea_zone(parameters)),
        Plate(
            "cribriform plate",
            CRIBRIFORM_MM,
            Label.CRIBRIFORM,
            _cribriform_zone(parameters),
        ),
        Plate(
            "lateral lamella",
            LATERAL_LAMELLA_MM,
            Label.CRIBRIFORM,
            _lateral_zone(parameters),
        ),
    )


def roofed(parameters: PhantomParameters) -> Field:
    """Build the space over the roof's plates, where the skull has no other bone."""
    side = u - depth_table([10, 20, 35, 50, 56], [10.8, 12.4, 13.5, 14.4, 14.7], 2.0)
    over = -below_base(parameters) - OVER_MM
    return smooth_max(0.0, side, y - FRONT_MM, REAR_MM - y, over)


def behind_roof(parameters: PhantomParameters) -> Field:
    """Build the dura's space behind the plates of the roof, down to their mucosa."""
    below = below_base(parameters) - (UNDER_MM + 0.6)
    fossa = smooth_max(0.0, u - medial_wall(), _under_fossa(parameters))
    return smooth_max(0.0, roofed(parameters), smooth_min(0.0, below, fossa))


def fovea_zone(parameters: PhantomParameters) -> Field:
    """Build where walls are the fovea ethmoidalis."""
    # The corners of cells are rounded: their roof begins lower.
    below = below_base(parameters) - (UNDER_MM + 0.8)
    return smooth_max(0.0, roofed(parameters) - 1.5, below)


def _cribriform_zone(parameters: PhantomParameters) -> Field:
    # The fossa ends before and behind: there the cleft's roof is as thin. Above lie
    # the frontal sinuses' rear walls.
    under = _under_fossa(parameters)
    depth = smooth_max(0.0, REAR_MM - y, y - FRONT_MM - 7.0)
    over = -(CLEFT_MM + UNDER_MM) - under
    return smooth_max(0.0, u - FOSSA_MM, under, over, depth)


def _lateral_zone(parameters: PhantomParameters) -> Field:
    aside = smooth_max(0.0, FOSSA_MM - 0.3 - u, u - medial_wall() - 0.5)
    return smooth_max(0.0, roofed(parameters), aside, _under_fossa(parameters))


def _under_fossa(parameters: PhantomParameters) -> Field:
    """Be negative above the reach of the plate under the olfactory fossa."""
    return ethmoid_roof(parameters) - (keros_depth(parameters) + UNDER_MM) - z


FOSSA_MM = 3.6
"""Half width of both olfactory fossae together, at the lateral lamellae."""


SELLA_MM = 7.0
"""Depth of the sella turcica below the planum."""


def skull_base(parameters: PhantomParameters) -> Field:
    """Return the height of the brain's lower limit: fovea, fossa, orbital roof."""
    # Over the orbits the fossa's floor is arched as their roofs are; behind and beside
    # them it climbs to the temple.
    arch = (0.0, 1.2, 3.4, 5.6, 6.8, 6.2, 3.0)
    rise = Table(U, (10, 13, 18, 24, 31, 39, 46), arch, 4.0) * depth_table(
        [-5, 10, 24, 36, 46, 56], [0.3, 1.0, 0.8, 0.3, -0.1, 0.0], 4.0
    )
    temple = Table(U, (34, 42, 56), (0.0, 3.0, 17.0), 4.0)
    rise = rise + temple * depth_table([6, 18, 30, 46, 60], [0, 0.4, 1, 1, 0.2], 4.0)
    fossa = Table(U, (FOSSA_MM - 0.3, FOSSA_MM + 0.7), (1.0, 0.0), 0.3)
    reach = depth_table([6, 12, 34, 42], [0.0, 1.0, 1.0, 0.0], 3.0)
    sella = Table(U, (0, 4.5, 9), (1.0, 1.0, 0.0), 2.5) * depth_table(
        [64.5, 68.5, 76.5, 80], [0.0, 1.0, 1.0, -0.1], 2.0
    )
    rise = rise + _supraorbital_lift(parameters)
    # Over the sphenoid the planum lies lower than the fovea's line would lead.
    return (
        fovea(parameters)
        + rise
        - fossa * reach * (keros_depth(parameters) - 0.9)
        - sella * Affine(SELLA_MM)
    )


def _supraorbital_lift(parameters: PhantomParameters) -> Field:
    """Return how far supraorbital cells lift the floor of the skull over them."""
    hill = Table(U, (11, 18, 26), (0.0, 1.0, 0.0), 2.0) * depth_table(
        [10, 18, 29], [0.0, 1.0, 0.0], 3.0
    )
    low = min(parameters.roof_mm, 0.0)
    right, left = (
        2.4 - 0.7 * low if parameters.has("supraorbital-cell", side) else 0.0
        for side in (Side.RIGHT, Side.LEFT)
    )
    return hill * by_side(right, left) if right or left else Affine(0.0)


def below_base(parameters: PhantomParameters) -> Field:
    """Recall the depth below the skull base, which the common marks leave."""
    return Recall(Row.BASE, skull_base(parameters) - z)
