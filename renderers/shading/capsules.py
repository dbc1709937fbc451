"""The tools of a view as the shadow's kernels want them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from renderers.scene import Camera, Material, Mesh, Spine
from renderers.shading.materials import SURFACES

COLUMNS = 12
"""Of the table: start, unit axis, length, radius, free start, free end, absorbed."""


@dataclass(frozen=True, slots=True)
class Caster:
    """Place a tool in the light.

    spine: in the world. material: how much of the light it sends back.
    """

    spine: Spine
    material: Material = Material.METAL

    @classmethod
    def of(cls, mesh: Mesh, world_from_mesh: NDArray[np.float64]) -> "Caster":
        """Place a mesh by a rigid 4x4 transform."""
        return cls(mesh.spine(world_from_mesh), mesh.material)


def capsule_table(casters: Sequence[Caster], camera: Camera) -> NDArray[np.float32]:
    """Return ``(n, 12)`` float32 rows in mm from the eye, world axes.

    Only what lies before the plane of the fibre ends: light from there to what the
    lens sees never goes behind it. Where a capsule is cut by that plane its end counts
    as a joint. A tool that the lens is in is not drawn and hides no light.
    """
    rows = []
    forward = camera.frame[3]
    for caster in casters:
        spine = caster.spine
        if spine.holds(camera.eye_mm):
            continue
        surface = SURFACES[caster.material]
        albedo = surface.f0 + (surface.red + surface.green + surface.blue) / 3
        starts, ends = spine.start_mm - camera.eye_mm, spine.end_mm - camera.eye_mm
        for start, end, radius, is_free in zip(
            starts, ends, spine.radius_mm, spine.is_free, strict=True
        ):
            before, after = float(start @ forward), float(end @ forward)
            if max(before, after) <= 0:
                continue
            free = [float(is_free[0]), float(is_free[1])]
            cut = start + (end - start) * before / (before - after or 1.0)
            if before < 0:
                start, free[0] = cut, 0.0
            elif after < 0:
                end, free[1] = cut, 0.0
            length = float(np.linalg.norm(end - start))
            if length <= 0:
                continue
            axis = (end - start) / length
            rows.append([*start, *axis, length, radius, *free, 1 - albedo, 0.0])
    return np.array(rows, np.float32).reshape(len(rows), COLUMNS)
