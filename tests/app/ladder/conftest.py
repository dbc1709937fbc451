"""Heads that the person flies in."""

from pathlib import Path

import pytest

from app.__main__ import main


@pytest.fixture(scope="module")
def cases(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """A made head as a case, and its CT imported as a scan of nobody known."""
    folder = tmp_path_factory.mktemp("cases")
    made, imported = folder / "made", folder / "imported"
    coarse = ["--spacing", "1.0"]
    assert main(["phantom", "--out", str(made), *coarse]) == 0
    scan = ["import", str(made / "ct.nrrd"), "--out", str(imported), *coarse]
    assert main(scan) == 0
    return [made, imported]
