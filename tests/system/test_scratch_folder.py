"""Scratch folders: the dead's are removed, the living's are not."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from system.scratch_folder import scratch_folder

HOLD = """
import sys, time
from pathlib import Path
from system.scratch_folder import scratch_folder
with scratch_folder(Path(sys.argv[1]), "spool-") as folder:
    (folder / "data").write_bytes(b"x" * 100)
    print(folder, flush=True)
    time.sleep(600)
"""


def holder(parent: Path) -> tuple["subprocess.Popen[str]", Path]:
    child = subprocess.Popen(
        [sys.executable, "-c", HOLD, str(parent)],
        stdout=subprocess.PIPE,
        text=True,
        cwd=Path(__file__).parents[2],
    )
    assert child.stdout is not None
    return child, Path(child.stdout.readline().strip())


def test_it_is_gone_afterwards_and_nobody_elses(tmp_path: Path) -> None:
    with scratch_folder(tmp_path / "a" / "b", "spool-") as folder:
        assert folder.parent == tmp_path / "a" / "b"
        assert folder.stat().st_mode & 0o077 == 0
        with scratch_folder(folder.parent, "spool-") as other:
            assert other != folder
        assert folder.exists()
        assert not other.exists()
    assert not folder.exists()


def test_the_next_start_removes_what_a_killed_process_left(tmp_path: Path) -> None:
    killed, left = holder(tmp_path)
    living, kept = holder(tmp_path)
    (tmp_path / "else").mkdir()
    try:
        killed.send_signal(signal.SIGKILL)
        killed.communicate()
        assert (left / "data").exists()
        with scratch_folder(tmp_path, "spool-"):
            assert not left.exists()
            assert (kept / "data").exists()
        assert (tmp_path / "else").exists()
    finally:
        living.kill()
        living.communicate()


def test_one_that_was_never_locked_is_nobodys(tmp_path: Path) -> None:
    """Its maker was killed between two steps; makers take turns, so none is at it."""
    (tmp_path / "spool-half").mkdir()
    with scratch_folder(tmp_path, "spool-"):
        assert not (tmp_path / "spool-half").exists()


def test_where_the_parent_cannot_be_used(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    with scratch_folder(tmp_path / "file", "spool-") as folder:
        assert folder.parent == tmp_path
    assert os.listdir(tmp_path) == ["file"]
