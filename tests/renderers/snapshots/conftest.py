"""A client of a spool of its own."""

from pathlib import Path

import pytest

from renderers.scene import Camera, Scene
from renderers.snapshots.client import SnapshotClient


@pytest.fixture
def client(tmp_path: Path) -> SnapshotClient:
    """Get a client that soon takes a silent worker for dead."""
    return SnapshotClient(tmp_path / "spool", name="test", lease_s=0.4)


@pytest.fixture
def job(client: SnapshotClient, scene: Scene, outside: Camera) -> str:
    """Ask for a picture of the small scene."""
    return client.submit(client.request_classic(scene, outside))
