"""A folder that a command fills, owned by one running command at a time."""

import fcntl
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def claimed_folder(folder: Path) -> Iterator[Path]:
    """Create `folder` and hold it; a second command is refused, not mixed in.

    Raises ValueError when another command holds it or it cannot be written.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        handle = os.open(folder / ".lock", os.O_CREAT | os.O_RDWR, 0o644)
    except OSError as error:
        raise ValueError(
            f"The folder {folder} cannot be written ({error.strerror}); choose another "
            "with --out."
        ) from error
    try:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise ValueError(
                f"Another command is writing to {folder}; wait for it or choose "
                "another folder with --out."
            ) from None
        yield folder
    finally:
        os.close(handle)


def remove_old_session(folder: Path) -> None:
    """Remove a recorded session, and nothing that is not one."""
    if not folder.exists():
        return
    known = {"session.json", "stream.mcap", "snapshots", "result.json"}
    strange = [entry.name for entry in folder.iterdir() if entry.name not in known]
    if strange:
        raise ValueError(
            f"{folder} holds {strange[0]!r}, which is not part of a session; move it "
            "away or choose another folder with --out."
        )
    shutil.rmtree(folder)
