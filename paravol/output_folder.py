"""A folder that a command fills, owned by one running command at a time."""

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from anatomy.case import RECORD, CaseRecord
from system import NoLocksError, UserError, lock_file
from system.plain_text import checked_name
from system.typed_record import read_kept

EXERCISE_FILES = ("exercise.toml", "exercise.path.json")
"""The scenario that is made for a case and for a person to edit, and its path."""


@contextmanager
def claimed_folder(folder: Path, *, mode: int = 0o777) -> Iterator[Path]:
    """Create `folder` and hold it; a second command is refused, not mixed in.

    mode: of a folder that is made, less what the user's umask takes away.

    A folder that was made for a command and stays empty is gone afterwards, and so is
    what a command has added that does not come to its end. Raises UserError when
    another command holds it or it cannot be written.
    """
    checked_name(folder)
    is_ours = not folder.exists()
    try:
        folder.mkdir(mode, parents=True, exist_ok=True)
        handle = os.open(folder / ".lock", os.O_CREAT | os.O_RDWR, 0o644)
    except OSError as error:
        raise UserError(
            f"The folder {folder} cannot be written ({error.strerror}); choose another "
            "with --out."
        ) from error
    try:
        try:
            with suppress(NoLocksError):
                lock_file(handle, waits=False)
            if os.fstat(handle).st_nlink == 0:
                raise BlockingIOError  # whose lock it was ended just now
        except BlockingIOError:
            raise UserError(
                f"Another command is writing to {folder}; wait for it or choose "
                "another folder with --out."
            ) from None
        before = {entry.name for entry in folder.iterdir()}
        try:
            yield folder
        except BaseException:
            _remove_new(folder, before)
            raise
        finally:
            # Windows keeps the name of an open file
            with suppress(PermissionError):
                (folder / ".lock").unlink(missing_ok=True)
            if is_ours and not any(folder.iterdir()):
                folder.rmdir()
    finally:
        os.close(handle)


def _remove_new(folder: Path, before: set[str]) -> None:
    """Remove what was not there before."""
    for entry in folder.iterdir():
        if entry.name in before:
            continue
        if entry.is_dir() and not entry.is_symlink():
            shutil.rmtree(entry, ignore_errors=True)
        else:
            with suppress(OSError):
                entry.unlink()


@contextmanager
def claimed_case(folder: Path, *, force: bool = False) -> Iterator[Path]:
    """Claim a folder for a case: a new one or an empty one; a case's with `force`.

    Raises UserError for a file, for a folder that holds something else, and without
    `force` for one that holds a case, saying which.
    """
    if folder.exists() and not folder.is_dir():
        raise UserError(f"{folder} is a file; name a folder for the case with --out.")
    held = sorted(entry.name for entry in folder.iterdir()) if folder.exists() else []
    if held not in ([], [".lock"]) and RECORD not in held:
        raise UserError(
            f"{folder} holds {held[0]!r} and no {RECORD}: it is no case; choose "
            "another folder with --out, or empty it."
        )
    if RECORD in held and not force:
        raise UserError(
            f"{folder} holds {_what_is_held(folder)} already; choose another folder "
            "with --out, or write over it with --force."
        )
    # a patient's head is nobody else's
    with claimed_folder(folder, mode=0o700):
        yield folder


def _what_is_held(folder: Path) -> str:
    """Describe a case, and what a person may have changed in it."""
    record = read_kept(folder / RECORD, CaseRecord)
    if record is None:
        kind = "a case"
    else:
        names = " and ".join(source.name for source in record.sources)
        kind = f"the case of {names}" if names else "the case of a phantom"
        if record.parameters is not None:
            kind += f" (seed {record.parameters.seed})"
    own = [name for name in EXERCISE_FILES if (folder / name).exists()]
    return kind + (f" with its {own[0]}" if own else "")


def remove_exercise(folder: Path) -> None:
    """Remove the exercise of a case that is written over: its way in is another's."""
    for name in EXERCISE_FILES:
        (folder / name).unlink(missing_ok=True)


def remove_old_session(folder: Path) -> None:
    """Remove a recorded session, and nothing that is not one."""
    if not folder.exists():
        return
    known = {"session.json", "stream.mcap", "snapshots", "result.json"}
    strange = [entry.name for entry in folder.iterdir() if entry.name not in known]
    if strange:
        raise UserError(
            f"{folder} holds {strange[0]!r}, which is not part of a session; move it "
            "away or choose another folder with --out."
        )
    shutil.rmtree(folder)
