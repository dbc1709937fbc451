"""The cases that somebody flew through: folders, wherever they lie.

`paravol import` and `paravol phantom` write a case to any place, so the window
remembers the folders that were opened. Those in `CASES` below the data directory are
found without being opened first.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import msgspec
import platformdirs

from anatomy.case import RECORD, CaseRecord
from system import UserError

CASES = "cases"
MOST = 12
"""Cases that are remembered."""


@dataclass(frozen=True, slots=True)
class KnownCase:
    """A case: its folder, a title, and what it was made of."""

    folder: Path
    title: str
    about: str


def cases_folder() -> Path:
    """Return where cases are found without being opened first."""
    return platformdirs.user_data_path("paravol", appauthor=False) / CASES


def case_at(folder: Path) -> KnownCase:
    """Return the case in a folder; UserError where there is none.

    Only its description is read; volumes are not.
    """
    try:
        content = (folder / RECORD).read_bytes()
        record = msgspec.json.decode(content, type=CaseRecord)
    except OSError as error:
        raise UserError(
            f"{folder} is no case: {RECORD} cannot be read ({error.strerror}). Choose "
            "a folder that paravol import or paravol phantom wrote."
        ) from error
    except (ValueError, RecursionError) as error:
        raise UserError(
            f"The case {folder} cannot be used: {RECORD} is not valid ({error})."
        ) from error
    if record.parameters is not None:
        about = f"A phantom, seed {record.parameters.seed}"
    else:
        made = [f"{source.modality} {source.name}".strip() for source in record.sources]
        about = ", ".join(made) or "An imported head"
    return KnownCase(folder, folder.resolve().name, about)


def is_case(folder: Path) -> bool:
    """Return whether a folder says that it is a case."""
    return (folder / RECORD).is_file()


def known_cases(
    remembered: Sequence[str], folder: Path | None = None
) -> list[KnownCase]:
    """Return the remembered cases that are still there, then those of the folder.

    folder: None for the user's `CASES`. What is no case any more is left out.
    """
    folder = cases_folder() if folder is None else folder
    there = sorted(path.parent for path in folder.glob(f"*/{RECORD}"))
    found: dict[Path, KnownCase] = {}
    for place in [*map(Path, remembered), *there]:
        try:
            found.setdefault(place.resolve(), case_at(place))
        except UserError:
            continue
    return list(found.values())


def add_case(remembered: Sequence[str], folder: Path) -> tuple[str, ...]:
    """Return the remembered folders with this one first, `MOST` at most."""
    name = str(folder.resolve())
    return (name, *(other for other in remembered if other != name))[:MOST]
