"""The nasal cavity of one side: septum, turbinates, lateral wall, vestibule, pharynx.

Coordinates and sizes follow radiological averages of adult noses; where none was
found they were chosen so that the views of a nasal endoscopy come out.
"""

from anatomy.phantom import uncinate
from anatomy.phantom.disease import polyps
from anatomy.phantom.ethmoid import ethmoid_roof, lateral_wall
from anatomy.phantom.fixed_shapes import SHAPES, course
from anatomy.phantom.head import head_outside
from anatomy.phantom.parameters import PhantomParameters
from anatomy.phantom.program import Row
from anatomy.phantom.shapes import (
    Affine,
    Chain,
    Field,
    Mark,
    Table,
    U,
    Unevenness,
    bump,
    depth_table,
    height_table,
    smooth_max,
    smooth_min,
    u,
    y,
    z,
)
from anatomy.phantom.sphenoid import sphenoid_face
from anatomy.phantom.turbinates import middle_bow, middle_lean, turbinates
from anatomy.tissue import Side

SPUR_MM = 2.6
"""How far a septal spur stands out."""


DUCT_MUCOSA_MM = 0.8
"""Over the bone of the nasolacrimal canal."""

CONGESTED_MM = 0.35
"""How far the mucosa of walls and septum swells at full congestion; the turbinates do
by up to 1.8 mm."""


def septum_face(parameters: PhantomParameters, side: Side) -> Field:
    """Return the lateral position of the septum's mucosa, with any spur."""
    face: Field = height_table(
        [0, 4, 12, 20, 30, 45], [2.0, 1.3, 1.4, 1.5, 1.77, 1.0], 1.5
    )
    thin_rear = depth_table([22, 45, 52], [0.0, -0.5, -0.25], 3.0)
    swell_body = depth_table([-2, 10, 22], [0.0, 0.45, 0.0], 4.0) * height_table(
        [18, 26, 34], [0.0, 1.0, 0.0], 3.0
    )
    face = face + thin_rear + swell_body
    if parameters.has("septal-spur", side):
        face = face + bump((-48.0, -34.0, -20.0), (5.0, 9.0, 13.0)) * Affine(SPUR_MM)
    return face


def cavity(parameters: PhantomParameters, side: Side) -> Field:
    """Build the main passage between septum and lateral wall, without contents."""
    wall = smooth_min(
        2.0,
        lateral_wall(),
        depth_table([-14, -6, 0, 6, 14, 60], [3.8, 4.6, 5.4, 9.6, 14, 14], 1.0),
    )
    # Beside the uncinate process the meatus is as wide as its course.
    wall = smooth_min(1.0, wall, uncinate.middle(parameters, side) + 0.6)
    # The floor rises towards both walls as a shallow gutter.
    floor = depth_table([-12, -4, 2, 10, 55], [-0.8, -1.0, -0.8, 0.2, 1.0]) + Table(
        U, (-4, 0, 3, 6, 9, 12, 14), (5.5, 2.0, 0.5, 0.0, 0.5, 2.0, 3.5), 1.5
    )
    cribriform = ethmoid_roof(parameters) - parameters.keros(side)
    dorsum = depth_table([-18, -8, 2, 10, 18], [9, 18, 31, 40, 60], 1.5)
    roof = smooth_min(2.0, cribriform, dorsum)
    rear = sphenoid_face()
    passage = smooth_max(
        2.0,
        smooth_max(1.2, septum_face(parameters, side) - u, u - wall),
        smooth_max(3.0, floor - z, (z - roof) * 0.85),
    )
    return smooth_max(1.0, passage, smooth_max(1.0, y - 12, rear - y))


def nasopharynx() -> Field:
    """Build the nasopharynx, symmetrical about the midline, with tube and torus."""
    roof = depth_table([57, 66, 72, 80], [22.5, 20, 15, 2], 1.5)
    arch = height_table([-12, -4, 4, 12, 20, 26], [5.6, 1.4, 0, 1.4, 5.6, 8], 2.0)
    bend = Table(
        U, (-18, -13, -8, -4, 0, 4, 8, 13, 18), (8, 5.9, 2.2, 0.6, 0, 0.6, 2.2, 5.9, 8)
    )
    box = smooth_max(2.5, abs(u) - 13.0, smooth_max(3.0, -30.0 - z, (z - roof) * 0.8))
    box = smooth_max(4.0, box, smooth_max(1.5, y + 56, arch + bend - 74.5 - y))
    torus, orifice, fossa = (
        _both_sides(course(name))
        for name in ("torus", "tube orifice", "pharyngeal fossa")
    )
    box = smooth_max(1.2, box, -Mark(Row.TORUS, torus))
    return smooth_min(1.0, smooth_min(0.8, box, orifice), fossa)


def _both_sides(chain: Chain) -> Field:
    mirrored = tuple((-a, b, c) for a, b, c in chain.points)
    return smooth_min(0.0, chain, Chain(mirrored, chain.radii))


def nasal_air(parameters: PhantomParameters, side: Side) -> Field:
    """Build the air of one side of the nose with pharynx and outside."""
    solids = turbinates(parameters, side)
    pharynx = Mark(Row.PHARYNX, nasopharynx() + Unevenness(1, 1.0))
    air = smooth_min(2.0, cavity(parameters, side), pharynx)
    air = smooth_min(2.5, air, smooth_max(0.8, SHAPES["vestibule"], 1.3 - u))
    lamella = middle_lean(parameters, side) + middle_bow(parameters, side)
    air = smooth_min(1.0, air, uncinate.medial_slit(parameters, side, lamella))
    air = smooth_max(1.5, air, DUCT_MUCOSA_MM - uncinate.duct_wall())
    air = smooth_max(0.8, air, -solids.inferior)
    air = smooth_max(0.8, air, -solids.middle)
    air = smooth_max(0.5, air, -solids.superior)
    air = smooth_max(0.8, air, -solids.uncinate)
    if parameters.is_operated(side):
        air = smooth_min(1.0, air, SHAPES["opened meatus"])
    air = smooth_min(0.8, air, SHAPES["superior meatus"])
    grown = polyps(parameters.opacity_of(side).polyps)
    if grown is not None:
        air = smooth_max(1.0, air, -Mark(Row.POLYP, grown))
    if parameters.congestion > 0.0:
        air = air + CONGESTED_MM * parameters.congestion
    air = air + Unevenness(0, 1.0)
    return smooth_min(2.0, air, Mark(Row.OUTSIDE, head_outside()))
