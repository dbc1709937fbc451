"""A folder of automatically recorded flights; the oldest make room for new ones."""

import datetime
import fcntl
import os
import re
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

import msgspec
import platformdirs

KEPT_BYTES = 1_000_000_000
"""Of a user's flights so much is kept: some twenty hours."""

SUFFIX = ".paravol"


class _Described(msgspec.Struct):
    """The part of session.json that says whether and when it may be removed."""

    created: str
    automatic: bool = False


@dataclass(frozen=True, slots=True)
class SessionStore:
    """Keep sessions in a folder; remove the oldest where they are too much.

    Only sessions marked as automatic are ever removed, and none that is being recorded:
    a link, a session that was recorded by name and everything else in the folder stays.
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
        self.folder.mkdir(parents=True, exist_ok=True)
        place = self._made(stem)
        with _held(place):
            self.make_room()
            yield place

    def make_room(self) -> list[Path]:
        """Remove the oldest until the rest is within the limit; give those removed."""
        found = []
        for folder in self.folder.glob(f"*{SUFFIX}"):
            created = _removable(folder)
            if created is not None:
                found.append((created, folder, _size(folder)))
        found.sort()
        total = sum(size for _, _, size in found)
        removed = []
        for _, folder, size in found:
            if total <= self.limit_bytes:
                break
            if _remove(folder):
                removed.append(folder)
                total -= size
        return removed

    def _made(self, stem: str) -> Path:
        number = 1
        while True:
            name = stem if number == 1 else f"{stem}_{number}"
            place = self.folder / f"{name}{SUFFIX}"
            try:
                place.mkdir()
            except FileExistsError:
                number += 1
            else:
                return place


@contextmanager
def _held(folder: Path) -> Iterator[None]:
    """Lock a folder for as long as this process fills it."""
    handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        # A disk that knows no locks keeps sessions all the same.
        with suppress(OSError):
            fcntl.flock(handle, fcntl.LOCK_EX)
        yield
    finally:
        os.close(handle)


def _removable(folder: Path) -> str | None:
    """Return when an automatic session began; None for everything else."""
    if folder.is_symlink() or not folder.is_dir():
        return None
    try:
        raw = (folder / "session.json").read_bytes()
        described = msgspec.json.decode(raw, type=_Described)
    except (OSError, msgspec.DecodeError):
        return None
    return described.created if described.automatic else None


def _size(folder: Path) -> int:
    """Return the bytes of all files below a folder that can be read."""
    total = 0
    for path, _, files in os.walk(folder):
        for file in files:
            with suppress(OSError):
                total += os.lstat(os.path.join(path, file)).st_size
    return total


def _remove(folder: Path) -> bool:
    """Remove a session unless it is being recorded; return whether it is gone."""
    try:
        handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
    except OSError:
        return False
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        shutil.rmtree(folder)
    except OSError:
        return False
    finally:
        os.close(handle)
    return True
