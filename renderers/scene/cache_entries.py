"""Files of a cache: read by trying, kept by last use, dropped when there are many."""

import logging
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from system import ForeignFileError, foreign_file, whole_file

log = logging.getLogger(__name__)

Kept = TypeVar("Kept")


def mark_used(entry: Path) -> None:
    """Note that an entry has been of use now. Raises OSError where it is gone."""
    os.utime(entry)


def read_arrays(entry: Path, what: str, read: Callable[[Any], Kept]) -> Kept | None:
    """Read an entry of arrays; None if there is none or it is not what was stored.

    what: it holds, with its article. read: is given the open archive; a ValueError of
    it means that the entry is broken.
    """
    if not entry.is_file():
        return None
    try:
        with (
            foreign_file(entry, what),
            entry.open("rb") as file,
            np.load(file, allow_pickle=False) as archive,
        ):
            found = read(archive)
        mark_used(entry)
    except (ForeignFileError, OSError) as error:
        log.warning("%s is broken and is made again: %s", entry, error)
        return None
    return found


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
