"""Files that other processes read: whole or not at all."""

import os
from pathlib import Path

from disk import whole_file
from renderers.art.job_steps import Step, reached

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
    # A job that was pruned meanwhile is not to be brought back.
    with whole_file(
        path, prefix=HIDDEN, ending="", mode=0o600, makes_folder=False
    ) as beside:
        beside.write_bytes(record)
        if lasting:
            make_last(beside)
        reached(Step.FILE_WRITTEN)
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
