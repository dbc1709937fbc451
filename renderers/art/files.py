"""Files that other processes read: whole or not at all."""

import os
import tempfile
from pathlib import Path

from renderers.art.steps import Step, reached

HIDDEN = ".tmp-"
"""How the names of unfinished files begin."""


def write_whole(
    path: Path, record: bytes | memoryview, *, lasting: bool = True
) -> None:
    """Write a file beside its place and move it there: nobody ever sees half of it.

    lasting: the bytes have reached the disk before the name does, and the name on
    return, so that not even a crash of the machine loses the file. It takes the disk's
    time twice; do without for what is soon replaced, or see `make_last`. Raise OSError
    when the disk refuses.
    """
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=HIDDEN)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(record)
            if lasting:
                file.flush()
                os.fsync(file.fileno())
        reached(Step.FILE_WRITTEN)
        os.replace(name, path)
    except BaseException:
        os.unlink(name)
        raise
    if lasting:
        make_last(path.parent)


def make_last(*paths: Path) -> None:
    """Let files' bytes, or the names in folders, reach the disk."""
    for path in paths:
        handle = os.open(path, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)
