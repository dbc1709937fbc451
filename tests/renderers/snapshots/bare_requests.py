"""Requests for arrays that need not be there, and a tool before a lens."""

from typing import Any

import numpy as np

from renderers.scene import Camera, Material, Mesh
from renderers.scene.mesh import PlacedMesh
from renderers.snapshots.request import (
    REQUEST_SCHEMA,
    CameraSpec,
    ClassicWork,
    GridSpec,
    ImageSpec,
    NodeSpec,
    ScopeWork,
    SnapshotRequest,
)

DIGEST = "0123456789abcdef" * 4
GRID = GridSpec((1.0, 1, 1), (0.0, 0, 0), ((1.0, 0, 0), (0.0, 1, 0), (0.0, 0, 1)))
CAMERA = CameraSpec((0.0, 0, 0), ((1.0, 0, 0), (0.0, 0, 1), (0.0, -1, 0)), 0.7)
NODES = (NodeSpec(0.0, (1.0, 1, 1), 0.0), NodeSpec(9.0, (1.0, 1, 1), 2.0))
CLASSIC = ClassicWork(DIGEST, GRID, NODES)


def bare_request(number: int, digest: str = DIGEST, **more: Any) -> SnapshotRequest:
    """Ask for a small view in mode scope; the number becomes the job's."""
    work = ScopeWork(digest, digest, digest, GRID)
    known: dict[str, Any] = {"camera": CAMERA, "image": ImageSpec(8, 8), "work": work}
    return SnapshotRequest(schema=REQUEST_SCHEMA, id=f"{number:032x}", **known | more)


def blade(camera: Camera) -> PlacedMesh:
    """Hold a metal triangle before the lens."""
    corners = np.array([[-0.5, -0.5, 1], [0.5, -0.5, 1], [0, 0.5, 1.0]])
    pose = np.eye(4)
    # Right, up, forward are left-handed: the blade is turned over instead.
    pose[:3, :3] = camera.frame[1:].T * [-1, 1, 1]
    pose[:3, 3] = camera.eye_mm
    return Mesh(corners, np.array([[0, 1, 2]]), Material.METAL), pose
