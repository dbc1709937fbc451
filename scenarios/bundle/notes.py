"""Notes on a recording, by whoever teaches: beside its stream, which stays."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Literal

import msgspec

from scenarios.bundle.info import write_json
from system import UserError, locked
from system.typed_record import decode_json

FILE = "notes.json"

LONGEST_NOTE = 2000
"""Letters."""


class Note(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Something about a moment of a session; at_s: second of the recording."""

    at_s: Annotated[float, msgspec.Meta(ge=0)]
    text: Annotated[str, msgspec.Meta(min_length=1, max_length=LONGEST_NOTE)]


class _Notes(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    notes: tuple[Note, ...] = ()
    schema_version: Literal[1] = 1


def read_notes(folder: Path) -> tuple[Note, ...]:
    """Return a bundle's notes in order of time; none where nobody wrote any.

    UserError, with file and line, where notes.json does not say what it must.
    """
    file = folder / FILE
    try:
        content = file.read_bytes()
    except FileNotFoundError:
        return ()
    except OSError as error:
        raise UserError(f"{file} cannot be read: {error.strerror}.") from error
    return decode_json(content, _Notes, file, "notes on a session").notes


def add_note(folder: Path, at_s: float, text: str) -> tuple[Note, ...]:
    """Add a note to a bundle and return all, in order of time.

    The file is replaced as a whole; two programs take turns. UserError for an empty or
    overlong text, or a time before the session.
    """
    text = text.strip()
    if not 0 < len(text) <= LONGEST_NOTE:
        raise UserError(
            f"A note has 1 to {LONGEST_NOTE} letters, this one has {len(text)}."
        )
    if not 0.0 <= at_s < float("inf"):
        raise UserError(f"A note's time must be 0 or more seconds, got {at_s:g}.")
    with _turn(folder):
        notes = sorted((*read_notes(folder), Note(at_s, text)), key=lambda n: n.at_s)
        write_json(folder / FILE, _Notes(tuple(notes)))
    return tuple(notes)


def remove_note(folder: Path, number: int) -> tuple[Note, ...]:
    """Remove the note of this number, from 1 on, and return the others."""
    with _turn(folder):
        notes = list(read_notes(folder))
        if not 1 <= number <= len(notes):
            raise UserError(
                f"{folder} has {len(notes)} notes; there is no number {number}."
            )
        del notes[number - 1]
        write_json(folder / FILE, _Notes(tuple(notes)))
    return tuple(notes)


@contextmanager
def _turn(folder: Path) -> Iterator[None]:
    """Let one program at a time change the notes."""
    if not (folder / "session.json").is_file():
        raise UserError(f"{folder} is not a session: there is no session.json in it.")
    with locked(folder / "session.json"):
        yield
