"""A folder of automatically recorded flights; the oldest make room for new ones."""

import datetime
import os
import re
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

import msgspec
import platformdirs

from system import NoLocksError, lock_file
from system.typed_record import read_kept

KEPT_BYTES = 1_000_000_000
"""Of a user's flights so much is kept: some twenty hours."""

SUFFIX = ".paravol"

OWN = {"session.json", "stream.mcap", "result.json", "notes.json", "snapshots"}
"""What a session's folder holds; hidden files beside it are some system's."""


class Described(msgspec.Struct):
    """The part of session.json that tells sessions of a folder apart."""

    created: str
    scenario_name: str = ""
    automatic: bool = False


@dataclass(frozen=True, slots=True)
class SessionStore:
    """Keep sessions in a folder; remove the oldest where they are too much.

    Only sessions marked as automatic are ever removed, and none that is being recorded
    or in which somebody put a file: a link, a session that was recorded by name and
    everything else in the folder stays.
    """

    folder: Path
    limit_bytes: int = KEPT_BYTES

    @classmethod
    def of_the_user(cls) -> "SessionStore":
        """Keep them below the user's data directory."""
        data = platformdirs.user_data_path("paravol", appauthor=False)
        return cls(data / "sessions")

    @contextmanager
    def new_session(self, name: str) -> Iterator[Path]:
        """Make a folder for a flight and hold it; make room beside it.

        name: of the exercise. Raises OSError where no folder can be made.
        """
        now = datetime.datetime.now()
        word = re.sub(r"[^\w-]+", "-", name).strip("-") or "flight"
        stem = f"{now:%Y-%m-%d_%H-%M-%S}_{word[:60]}"
        # what a trainee did is nobody else's
        self.folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        place = self._made(stem)
        with hold_session(place):
            self.make_room()
            yield place

    def make_room(self) -> list[Path]:
        """Remove the oldest until the rest is within the limit; give those removed."""
        own = [folder for folder in self.sessions() if not _is_shared(folder)]
        found = sorted((_removable(f) or "", f, _size(f)) for f in own)
        total = sum(size for _, _, size in found)
        removed = []
        for _, folder, size in found:
            if total <= self.limit_bytes:
                break
            if remove_session(folder):
                removed.append(folder)
                total -= size
        return removed

    def sessions(self) -> list[Path]:
        """Return the sessions that were recorded automatically, those of now too."""
        found = sorted(self.folder.glob(f"*{SUFFIX}"))
        return [folder for folder in found if _removable(folder) is not None]

    def _made(self, stem: str) -> Path:
        number = 1
        while True:
            name = stem if number == 1 else f"{stem}_{number}"
            place = self.folder / f"{name}{SUFFIX}"
            try:
                place.mkdir(mode=0o700)
            except FileExistsError:
                number += 1
            else:
                return place


@contextmanager
def hold_session(folder: Path) -> Iterator[None]:
    """Hold a session for as long as this process fills it; wait for another."""
    lock = _lock_of(folder)
    handle = os.open(lock, os.O_CREAT | os.O_RDWR, 0o600)
    try:
        # A disk that knows no locks keeps sessions all the same.
        with suppress(NoLocksError):
            lock_file(handle, waits=True)
        yield
    finally:
        os.close(handle)
        with suppress(OSError):
            lock.unlink()


def is_held(folder: Path) -> bool:
    """Return whether a living process fills an automatic session.

    Where there are no locks, a session of which a process died counts as filled.
    """
    try:
        handle = os.open(_lock_of(folder), os.O_RDWR)
    except FileNotFoundError:
        return False
    except OSError:
        return True
    try:
        lock_file(handle, waits=False)
    except OSError:
        return True
    finally:
        os.close(handle)
    return False


def remove_session(folder: Path) -> bool:
    """Remove a session unless it is being filled; return whether it is gone.

    What somebody else put into its folder stays there.
    """
    if folder.is_symlink() or is_held(folder):
        return False
    try:
        if not _is_shared(folder):
            shutil.rmtree(folder)
        else:
            shutil.rmtree(folder / "snapshots", ignore_errors=True)
            for name in OWN - {"snapshots"}:
                (folder / name).unlink(missing_ok=True)
    except OSError:
        return False
    with suppress(OSError):
        _lock_of(folder).unlink()
    return True


def _is_shared(folder: Path) -> bool:
    """Return whether somebody put a file into a session's folder.

    So it counts where nobody may look: another program may be removing it.
    """
    try:
        names = {entry.name for entry in folder.iterdir()}
    except OSError:
        return True
    return any(name not in OWN and not name.startswith(".") for name in names)


def _lock_of(folder: Path) -> Path:
    """Return the file that is locked: beside the session, which holds its own only."""
    return folder.with_name(f".{folder.name}.lock")


def _removable(folder: Path) -> str | None:
    """Return when an automatic session began; None for everything else."""
    if folder.is_symlink() or not folder.is_dir():
        return None
    described = read_kept(folder / "session.json", Described)
    return described.created if described and described.automatic else None


def _size(folder: Path) -> int:
    """Return the bytes of all files below a folder that can be read."""
    total = 0
    for path, _, files in os.walk(folder):
        for file in files:
            with suppress(OSError):
                total += os.lstat(os.path.join(path, file)).st_size
    return total
