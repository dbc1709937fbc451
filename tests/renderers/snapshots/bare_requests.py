"""Requests for arrays that need not be there: nobody draws them."""

from typing import Any

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
