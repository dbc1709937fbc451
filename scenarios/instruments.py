"""Surgical instruments as meshes."""

import numpy as np
import trimesh
from numpy.typing import NDArray

from disk import UserError
from renderers.scene import Material, Mesh

_SIDES = 32
"""Facets round a tube. At 10 mm from the lens of a 512-pixel picture a 3 mm tube is
100 pixels wide and the chord error of 32 facets a quarter of a pixel."""


def suction_tube(
    outer_mm: float = 2.4,
    bore_mm: float = 1.6,
    length_mm: float = 130.0,
    bend_start_mm: float = 70.0,
    bend_deg: float = 25.0,
) -> Mesh:
    """Build a Frazier suction: an open steel tube, straight at the tip, bent behind.

    Mesh frame: origin at the centre of the open tip, +z back up the shaft; the bend
    turns towards +y. Sizes of a 7 French (2.4 mm) tube.
    """
    if not 0 < bore_mm < outer_mm:
        raise UserError(f"a bore of {bore_mm} mm does not fit a {outer_mm} mm tube")
    if not 0 < bend_start_mm < length_mm:
        raise UserError(
            f"the bend must start within the {length_mm} mm tube, got {bend_start_mm}"
        )
    outer, bore = outer_mm / 2, bore_mm / 2
    rim = (outer - bore) / 2
    # A half-round rim: a sharp one would glint as a polygon.
    angles = np.linspace(0.0, np.pi, 9)
    lip = np.stack(
        [outer - rim + rim * np.cos(angles), rim - rim * np.sin(angles)], axis=1
    )
    stations = np.concatenate(
        [[bend_start_mm], np.linspace(bend_start_mm, length_mm, 24)[1:]]
    )
    outside = np.stack([np.full(len(stations), outer), stations], axis=1)[::-1]
    inside = np.stack([np.full(len(stations), bore), stations], axis=1)
    profile = np.concatenate([outside, lip, inside, outside[:1]])
    tube = trimesh.creation.revolve(profile, sections=_SIDES)
    tube.fix_normals()
    vertices = _bend(np.asarray(tube.vertices), bend_start_mm, length_mm, bend_deg)
    return Mesh(vertices, np.asarray(tube.faces, dtype=np.int32), Material.METAL)


def _bend(
    vertices: NDArray[np.float64], start_mm: float, end_mm: float, angle_deg: float
) -> NDArray[np.float64]:
    """Turn everything beyond `start_mm` along a circular arc in the y-z plane."""
    total = np.radians(angle_deg)
    if total == 0.0:
        return vertices
    radius = (end_mm - start_mm) / total
    turn = np.clip((vertices[:, 2] - start_mm) / radius, 0.0, total)
    bent = vertices.copy()
    arm = radius - vertices[:, 1]
    behind = vertices[:, 2] > start_mm
    bent[behind, 1] = (radius - arm * np.cos(turn))[behind]
    bent[behind, 2] = (start_mm + arm * np.sin(turn))[behind]
    return bent
