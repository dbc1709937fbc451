"""The surfaces of a case: the airway's, the skin's, and those around its labels."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from anatomy.case import Case
from anatomy.files.surfaces import Surface
from renderers.scene import Volume

SMALLEST_VOXELS = 200
"""A label of fewer voxels has no surface worth a file."""


def case_surfaces(case: Case) -> Iterator[tuple[float, str, Surface]]:
    """Give each surface of a case with the done share and its name.

    ``air`` is what the endoscope sees, ``skin`` the outside of the head; then one for
    each label, around its voxels. Normals point out of what a surface is named by. A
    label's is closed, where the volume ends too.
    """
    for name, volume, is_inside_out in (
        ("air", "distance", False),
        ("skin", "face", True),
    ):
        if volume in case.volumes:
            surface = zero_set(case.volumes[volume])
            if surface is not None and is_inside_out:
                # what is positive lies in the head
                surface = Surface(surface.vertices, surface.faces[:, ::-1])
            if surface is not None:
                yield 0.0, name, surface
    labels = case.labels
    values, counts = np.unique(labels.values, return_counts=True)
    large = [int(v) for v in values[counts >= SMALLEST_VOXELS] if v != 0]
    for number, value in enumerate(large):
        surface = zero_set(_around(labels, value))
        if surface is not None:
            name = case.record.label_names.get(str(value), f"label {value}")
            yield (number + 1) / len(large), name, surface


def _around(labels: Volume, value: int) -> Volume:
    """Return -0.5 in a label, 0.5 around it, with a voxel of that at each border."""
    mask = np.where(labels.values == value, np.float32(-0.5), np.float32(0.5))
    low = labels.world_from_voxel @ (-1.0, -1.0, -1.0, 1.0)
    return Volume(
        np.pad(mask, 1, constant_values=0.5),
        labels.spacing_mm,
        low[:3],
        labels.direction,
        0.5,
    )


def zero_set(volume: Volume) -> Surface | None:
    """Contour where a volume changes sign, None where it does not.

    Normals of the triangles point from the negative into the positive.
    """
    # Imported here: a command that refuses its input need not wait for it.
    import pyvista as pv

    nz, ny, nx = volume.shape
    grid: Any = pv.ImageData(dimensions=(nx, ny, nz))
    grid.point_data["value"] = np.asarray(volume.values, np.float32).ravel()
    mesh = grid.contour([0.0], scalars="value", compute_normals=False)
    if not mesh.n_points:
        return None
    # contoured in voxels and placed here: no axis can be lost on the way
    matrix = volume.world_from_voxel
    points = np.asarray(mesh.points, np.float64) @ matrix[:3, :3].T + matrix[:3, 3]
    faces = np.asarray(mesh.regular_faces, np.int32)
    corners = points[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    sizes = np.linalg.norm(normals, axis=1)
    sure = sizes > np.percentile(sizes, 50)
    middle = corners[sure].mean(axis=1)
    step = 0.3 * float(volume.spacing_mm.min())
    ahead = volume.sample(middle + step * normals[sure] / sizes[sure, None])
    if np.mean(ahead > 0) < 0.5:
        faces = faces[:, ::-1]
    return Surface(points, np.ascontiguousarray(faces))
