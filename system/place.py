"""Check that a file can be written before the work that fills it."""

import errno
import os
import tempfile
from pathlib import Path


def require_place(path: Path) -> None:
    """Raise OSError, with the name that was asked for, where no file can be written.

    Leaves nothing behind: folders that are missing are made when the file is.
    """
    if path.is_dir():
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
    folder = path.absolute().parent
    while not os.path.lexists(folder):
        folder = folder.parent
    try:
        # by trying: what permissions say is not all that a disk may refuse
        tempfile.TemporaryFile(dir=folder).close()
    except OSError as error:
        error.filename = str(path)
        raise
