"""The folders through which pictures are asked for, by commands."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from system import UserError
from system.scratch_folder import scratch_folder


@contextmanager
def own_spool() -> Iterator[Path]:
    """Return a spool folder of this process's own, gone afterwards.

    It lies in the user's cache, where the next one removes what a killed process left.
    """
    from platformdirs import user_cache_path

    parent = user_cache_path("paravol", appauthor=False) / "spools"
    with scratch_folder(parent, "spool-") as folder:
        yield folder / "spool"


def require_spool(folder: Path, *, create: bool = False) -> None:
    """Raise UserError unless `folder` is a spool folder, or empty.

    create: make it if it is missing and its parent is there. A folder that is made
    because its name was mistyped is served, or filled, for nothing.
    """
    if create and not folder.exists():
        try:
            folder.mkdir(mode=0o700)
        except FileNotFoundError:
            raise UserError(
                f"There is no folder {folder.absolute().parent} to make "
                f"{folder.name} in."
            ) from None
    if not folder.exists():
        raise UserError(
            f"There is no spool folder {folder}; correct the name, or make it with "
            f"paravol worker --spool {folder} --create."
        )
    if folder.is_dir() and not (folder / "queue").is_dir():
        held = sorted(entry.name for entry in folder.iterdir())
        if held:
            raise UserError(
                f"{folder} is no spool folder: it holds {held[0]!r} and no queue."
            )
