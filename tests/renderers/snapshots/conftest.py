"""A spool folder of a test's own, and who asks for pictures there."""

from pathlib import Path

import pytest

from renderers.snapshots.client import SnapshotClient


@pytest.fixture
def client(tmp_path: Path) -> SnapshotClient:
    """Get a client that soon takes a silent worker for dead."""
    return SnapshotClient(tmp_path / "spool", name="test", lease_s=0.4)
