"""Files that appear whole or not at all."""

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """Give a place beside `path` to write to; what is written then takes its place.

    An exception inside, Ctrl-C included, leaves `path` as it was and nothing beside
    it. The folder is made if need be; the other file has the same ending, for writers
    that go by it, and is readable by all in the end. Raises OSError when the disk
    refuses.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    # on the same disk, so that replacing is one step
    try:
        handle, name = tempfile.mkstemp(dir=path.parent, prefix=".", suffix=path.suffix)
    except OSError as error:
        error.filename = str(path)  # the name that was asked for
        raise
    os.close(handle)
    beside = Path(name)
    try:
        yield beside
        # mkstemp makes files that only their owner may read
        beside.chmod(0o644)
        beside.replace(path)
    except BaseException:
        beside.unlink(missing_ok=True)
        raise
