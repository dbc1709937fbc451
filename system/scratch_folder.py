"""Folders for a process's own use, which do not outlive it for long."""

import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from system.file_lock import lock_file

_OWNER = ".owner"


@contextmanager
def scratch_folder(parent: Path, prefix: str) -> Iterator[Path]:
    """Return a folder below `parent` that is gone afterwards.

    What killed processes left there is removed first. An owner holds a lock, which the
    system takes from it when it dies, however it dies; a process number may be
    another's by then. Where `parent` cannot be used, the folder is a temporary one.
    """
    try:
        folder, lock = _claim(parent, prefix)
    except OSError:
        with tempfile.TemporaryDirectory(
            prefix=prefix, ignore_cleanup_errors=True
        ) as name:
            yield Path(name)
        return
    try:
        yield folder
    finally:
        # What another process still writes into it does not matter any more.
        shutil.rmtree(folder, ignore_errors=True)
        os.close(lock)


def _claim(parent: Path, prefix: str) -> tuple[Path, int]:
    """Make a folder and lock it, one process at a time; remove what nobody owns."""
    parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    turn = os.open(parent / ".turn", os.O_CREAT | os.O_RDWR, 0o600)
    try:
        lock_file(turn, waits=True)
        for old in parent.glob(f"{prefix}*"):
            if not _is_owned(old):
                shutil.rmtree(old, ignore_errors=True)
        folder = Path(tempfile.mkdtemp(prefix=prefix, dir=parent))
        lock = os.open(folder / _OWNER, os.O_CREAT | os.O_RDWR, 0o600)
        lock_file(lock, waits=False)
        return folder, lock
    finally:
        os.close(turn)


def _is_owned(folder: Path) -> bool:
    """Return whether the process that made a folder lives."""
    try:
        lock = os.open(folder / _OWNER, os.O_RDWR)
    except FileNotFoundError:
        return False  # its maker died, or removes it
    except OSError:
        return True  # somebody else's matter
    try:
        lock_file(lock, waits=False)
    except OSError:
        return True
    finally:
        os.close(lock)
    return False
