"""Files of a cache: read by trying, kept by last use, dropped when there are many."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from system import whole_file


def mark_used(entry: Path) -> None:
    """Note that an entry has been of use now. Raises OSError where it is gone."""
    os.utime(entry)


@contextmanager
def kept_entry(entry: Path, most: int) -> Iterator[Path]:
    """Return a place to write an entry to, which then appears whole.

    Of the files beside it with its ending, those not used for longest are removed
    until `most` are left. See `whole_file` for what is raised.
    """
    with whole_file(entry) as beside:
        yield beside
    entries = sorted(entry.parent.glob(f"*{entry.suffix}"), key=_last_use, reverse=True)
    for old in entries[most:]:
        old.unlink(missing_ok=True)


def _last_use(entry: Path) -> float:
    """Return the time of last use; another process may have removed the file."""
    try:
        return entry.stat().st_mtime
    except FileNotFoundError:
        return 0.0
