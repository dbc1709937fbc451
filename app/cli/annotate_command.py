"""`paravol annotate`: write, list and remove notes on a recording."""

from pathlib import Path
from typing import TYPE_CHECKING

from app.cli.root import Json
from app.cli.terminal import print_json, print_table
from system import UserError

if TYPE_CHECKING:
    from scenarios.bundle import Note


def annotate(
    session: Path,
    text: str = "",
    *,
    at: float | None = None,
    remove: int | None = None,
    json: Json = False,
) -> int:
    """Write a note on a moment of a recording, or list its notes.

    Notes lie beside the recording, which is not changed.

    Parameters
    ----------
    session
        A folder NAME.paravol.
    text
        The note; without it the notes are listed.
    at
        Second of the recording that it is about.
    remove
        Remove the note of this number, as listed.
    """
    from scenarios.bundle import add_note, read_notes, remove_note

    if bool(text) != (at is not None):
        raise UserError("A note needs its text and --at, the second it is about.")
    if text and remove is not None:
        raise UserError("Write a note or remove one, not both.")
    if at is not None:
        _require_time(session, at)
        notes = add_note(session, at, text)
    elif remove is not None:
        notes = remove_note(session, remove)
    else:
        notes = read_notes(session)
    if json:
        print_json(notes)
    else:
        print_table(f"Notes on {session}", note_rows(notes))
    return 0


def note_rows(notes: "tuple[Note, ...]") -> list[tuple[str, str]]:
    """Return the rows that tell notes, with the numbers that remove them."""
    if not notes:
        return [("notes", "none")]
    return [
        (f"{n}: at {note.at_s:.1f} s", note.text) for n, note in enumerate(notes, 1)
    ]


def _require_time(session: Path, at: float) -> None:
    from scenarios.bundle import SampleRecord, read_recording

    records = read_recording(session).records
    times = [r.time_s for r in records if isinstance(r, SampleRecord)]
    if not times or not times[0] <= at <= times[-1]:
        lasts = (
            f"lasts from {times[0]:.1f} to {times[-1]:.1f} s" if times else "is empty"
        )
        raise UserError(f"{session} {lasts} and has nothing at {at:g} s.")
