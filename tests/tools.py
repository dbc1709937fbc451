"""Instruments to put into small scenes."""

import numpy as np
from numpy.typing import NDArray

from renderers.scene import Camera, Material, Mesh
from renderers.scene.mesh import PlacedMesh


def rod(
    tip: NDArray[np.float64],
    end: NDArray[np.float64],
    radius_mm: float = 1.5,
    material: Material = Material.METAL,
) -> PlacedMesh:
    """Give a pointed rod of four sides from a tip to where it is thickest."""
    along = np.asarray(end, np.float64) - tip
    length = float(np.linalg.norm(along))
    z = along / length
    x = np.cross(z, [0.3, -0.8, 0.5])
    x /= np.linalg.norm(x)
    pose = np.eye(4)
    pose[:3] = np.stack([x, np.cross(z, x), z, tip], axis=1)
    r = radius_mm
    ring = [[r, 0, length], [0, r, length], [-r, 0, length], [0, -r, length]]
    corners = np.array([[0.0, 0, 0], *ring])
    sides = [[0, (k + 1) % 4 + 1, k + 1] for k in range(4)]
    faces = np.array([*sides, [1, 2, 3], [1, 3, 4]], np.int32)
    return Mesh(corners, faces, material), pose


def board(camera: Camera, depth_mm: float, half_mm: float) -> PlacedMesh:
    """Give a square of dark plastic across the view, so far before the eye."""
    h = half_mm
    corners = np.array([[-h, -h, 0], [h, -h, 0], [h, h, 0], [-h, h, 0]])
    pose = np.eye(4)
    right, up, forward = camera.frame[1:]
    # right, up, forward is left-handed, and a pose is not
    pose[:3] = np.stack(
        [-right, up, forward, camera.eye_mm + depth_mm * forward], axis=1
    )
    faces = np.array([[0, 1, 2], [0, 2, 3]], np.int32)
    return Mesh(corners, faces, Material.DARK_PLASTIC), pose
