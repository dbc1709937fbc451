"""The command of whoever teaches: notes on recordings.

Nothing heavy is imported here: the command fetches its own modules when it runs.
"""

from pathlib import Path

from app.cli.root import SESSIONS, Json, app


@app.command(group=SESSIONS)
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
    from app.cli.annotate_command import run_annotate

    return run_annotate(session, text, at, remove, as_json=json)
