"""Files that other processes read: whole or not at all."""

import os
import tempfile
from pathlib import Path

from renderers.art.steps import Step, reached

HIDDEN = ".tmp-"
"""How the names of unfinished files begin."""


def write_whole(path: Path, record: bytes | memoryview) -> None:
    """Write a file beside its place and move it there.

    The bytes reach the disk before the name does, so that a name never shows half a
    file, and the name has reached it on return: not even a crash of the machine then
    loses the file. Raise OSError when the disk refuses.
    """
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=HIDDEN)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(record)
            file.flush()
            os.fsync(file.fileno())
        reached(Step.FILE_WRITTEN)
        os.replace(name, path)
    except BaseException:
        os.unlink(name)
        raise
    sync_folder(path.parent)


def sync_folder(folder: Path) -> None:
    """Let the names in a folder reach the disk."""
    handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
