"""A capsule of steel before the lens."""

import copy

import numpy as np

from renderers.scene import Camera, GBuffer, Mesh
from renderers.shading.capsules import Caster


def tool(camera: Camera, buffer: GBuffer) -> tuple[GBuffer, Caster]:
    """Put a capsule of steel into the tube: its picture, and what casts its shadow."""
    turn = np.arange(24) * (2 * np.pi / 24)
    ring = 0.6 * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    ends = [np.column_stack([ring, np.full(24, z)]) for z in (0.0, 12.0)]
    i = np.arange(24)
    j = (i + 1) % 24
    faces = np.concatenate(
        [np.stack([i, j, 24 + j], 1), np.stack([i, 24 + j, 24 + i], 1)]
    )
    mesh = Mesh(np.concatenate(ends), faces.astype(np.int32))
    eye, right, up, forward = camera.frame
    pose = np.eye(4)
    # its tip 9 mm before the lens, and back past it on the right
    along = -forward + 0.25 * right
    along /= np.linalg.norm(along)
    side = np.cross(up, along)
    side /= np.linalg.norm(side)
    pose[:3, :3] = np.stack([side, np.cross(along, side), along], axis=1)
    pose[:3, 3] = eye + 9 * forward + 1.0 * right - 1.2 * up
    seen = copy.deepcopy(buffer)
    mesh.draw(seen, camera, pose)
    return seen, Caster.of(mesh, pose)
