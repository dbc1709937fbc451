"""Requests of a few words, and what comes of asking."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from renderers.scene import Camera, Material, Mesh
from renderers.snapshots.client import Snapshot, SnapshotClient
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
from renderers.snapshots.worker import run_worker

DIGEST = "0123456789abcdef" * 4
GRID = GridSpec((1.0, 1, 1), (0.0, 0, 0), ((1.0, 0, 0), (0.0, 1, 0), (0.0, 0, 1)))
CAMERA = CameraSpec((0.0, 0, 0), ((1.0, 0, 0), (0.0, 0, 1), (0.0, -1, 0)), 0.7)
NODES = (NodeSpec(0.0, (1.0, 1, 1), 0.0), NodeSpec(9.0, (1.0, 1, 1), 2.0))


def scope_request(number: int, digest: str = DIGEST, **more: Any) -> SnapshotRequest:
    """Ask for a small view of arrays that need not be there."""
    return SnapshotRequest(
        schema=REQUEST_SCHEMA,
        id=f"{number:032x}",
        camera=CAMERA,
        work=ScopeWork(digest, digest, digest, GRID),
        **({"image": ImageSpec(8, 8)} | more),
    )


def classic_work() -> ClassicWork:
    """Ask for the classic mode of such an array."""
    return ClassicWork(DIGEST, GRID, NODES)


def served(client: SnapshotClient, request: SnapshotRequest, **how: Any) -> Snapshot:
    """Ask, let a worker serve that alone, and get what it drew."""
    client.submit(request)
    assert run_worker(client.spool.folder, once=True, **how) == 1
    return client.wait(request.id)


def blade(camera: Camera) -> tuple[Mesh, NDArray[np.float64]]:
    """Hold a metal triangle before the lens."""
    corners = np.array([[-0.5, -0.5, 1], [0.5, -0.5, 1], [0, 0.5, 1.0]])
    pose = np.eye(4)
    # right, up, forward are left-handed: the blade is turned over instead
    pose[:3, :3] = camera.frame[1:].T * [-1, 1, 1]
    pose[:3, 3] = camera.eye_mm
    return Mesh(corners, np.array([[0, 1, 2]]), Material.METAL), pose
