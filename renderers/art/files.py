"""Files that other processes read: whole or not at all."""

import os
import tempfile
from pathlib import Path


def write_whole(path: Path, record: bytes | memoryview) -> None:
    """Write a file beside its place and move it there.

    The bytes reach the disk before the name does, so that a name never shows half a
    file, not even after a crash. Raise OSError when the disk refuses.
    """
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=".tmp-")
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(record)
            file.flush()
            os.fsync(file.fileno())
        os.replace(name, path)
    except BaseException:
        os.unlink(name)
        raise
