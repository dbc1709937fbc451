"""The orbit of one side: a cone of four walls, its fissures, and what moves the eye."""

from anatomy.phantom.ethmoid import lamina_papyracea
from anatomy.phantom.parameters import PhantomParameters
from anatomy.phantom.shapes import (
    Affine,
    Field,
    Table,
    U,
    depth_table,
    height_table,
    smooth_max,
    u,
    y,
    z,
)
from anatomy.phantom.sinuses import supraorbital
from anatomy.tissue import Side

FLOOR_BONE_MM = 0.5
"""Bone between the orbit and the maxillary sinus."""


def lateral_plane() -> Field:
    """Build the lateral wall's inner face, 40 degrees to the midline and bowed."""
    bow = depth_table([12, 22, 34, 48], [-1.2, 0.6, 0.8, -0.4], 6.0)
    return ((u - 17.5) - (y + 50.0) * Affine(0.8) - bow) * Affine(0.78)


def orbit_walls() -> Field:
    """Build the space inside the periorbita, without its medial and front walls.

    The roof arches, the floor falls away from the ethmoid and climbs towards the apex
    at the optic canal. No wall meets the next one in a corner.
    """
    roof: Field = depth_table(
        [2, 12, 24, 36, 46, 52], [55.5, 57.4, 55.2, 50, 46.0, 44.4], 3.0
    )
    arch = Table(U, (12, 17, 23, 31, 39, 47), (-4, -2, -0.4, 0.8, -0.6, -6), 3.0)
    roof = roof + arch * depth_table([28, 44], [1.0, 0.0], 3.0)
    fall = Table(U, (13, 20, 26, 32, 39, 47), (28.4, 27.4, 24.6, 22.2, 23.0, 28.5), 3.0)
    climb = depth_table([4, 14, 24, 34, 42, 51], [1.6, -0.6, 0.0, 3.0, 7.4, 11.5], 3.0)
    height = smooth_max(6.0, z - roof, (fall + climb - z) * Affine(0.9))
    side = lateral_plane() + height_table([23, 31, 38, 46, 55], [5, 1, 0, 0.8, 4], 4.0)
    cone = smooth_max(10.0, side, height)
    return smooth_max(2.0, cone, -51.5 - y)


def orbit(parameters: PhantomParameters, side: Side, skin: Field) -> Field:
    """Build the orbit of one side; the lamina papyracea bounds it medially.

    skin: the distance from the face, which bounds it in front.
    """
    wall = lamina_papyracea(parameters, side) + parameters.cell_bone_mm / 2
    walls = orbit_walls()
    if parameters.has("supraorbital-cell", side):
        lining = parameters.mucosa_mm + parameters.cell_bone_mm
        walls = smooth_max(1.0, walls, lining - supraorbital(parameters))
    return smooth_max(2.5, walls, smooth_max(1.0, wall - u, 3.0 - skin * 1.6))


def lateral_wall() -> Field:
    """Build the zygoma and greater wing beside the orbit: thinnest in the middle.

    Its rim and its root at the skull base are stout.
    """
    thick = depth_table([12, 20, 30, 40, 48], [4.6, 2.6, 1.5, 2.4, 4.2], 3.0)
    slab = smooth_max(1.5, orbit_walls() - thick, -2.5 - lateral_plane())
    return smooth_max(1.5, slab, smooth_max(1.5, z - 54.0, 23.0 - z))
