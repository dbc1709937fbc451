"""Files that appear whole or not at all."""

import errno
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

# to read it is to set it, which threads may not do beside each other
_UMASK = os.umask(0o077)
os.umask(_UMASK)

FULL = errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EROFS, errno.EIO
"""What a disk says that takes no more."""


@contextmanager
def whole_file(
    path: Path,
    *,
    prefix: str = ".",
    ending: str | None = None,
    mode: int | None = None,
    makes_folder: bool = True,
) -> Iterator[Path]:
    """Return a place beside `path` to write to; what is written then takes its place.

    prefix, ending: of the other file's name; None for the same ending, for writers that
    go by it. mode: of the file in the end; None as the user's umask has it.
    makes_folder: False where a folder that is gone must stay gone.

    An exception inside, Ctrl-C included, leaves `path` as it was and nothing beside
    it. Raises OSError when the disk refuses.
    """
    if makes_folder:
        path.parent.mkdir(parents=True, exist_ok=True)
    # on the same disk, so that replacing is one step
    try:
        suffix = path.suffix if ending is None else ending
        handle, name = tempfile.mkstemp(suffix, prefix, path.parent)
    except OSError as error:
        error.filename = str(path)  # the name that was asked for
        raise
    os.close(handle)
    # relative to what the caller's path is, which mkstemp does not keep
    beside = path.with_name(Path(name).name)
    try:
        yield beside
        # mkstemp makes files that only their owner may read
        beside.chmod(0o666 & ~_UMASK if mode is None else mode)
        beside.replace(path)
    except BaseException as error:
        beside.unlink(missing_ok=True)
        if isinstance(error, OSError) and error.errno in FULL and not error.filename:
            error.filename = str(path)  # a stream that is written to has no name
        raise
