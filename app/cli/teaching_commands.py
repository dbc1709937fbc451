"""Commands on single recordings: notes on them, and those that were never finished.

Nothing heavy is imported here: the command fetches its own modules when it runs.
"""

from pathlib import Path

from app.cli.root import SESSIONS, Flag, Json, app


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


@app.command(group=SESSIONS)
def unfinished(
    session: Path | None = None,
    *,
    recover: Flag = False,
    discard: Flag = False,
    no_store: Flag = False,
    json: Json = False,
) -> int:
    """List flights that ended with the program, and finish or remove them.

    Parameters
    ----------
    session
        A folder NAME.paravol; all in the user's data directory when left out.
    recover
        Score what was flown and write the result.
    discard
        Remove the recordings for good.
    no_store
        Leave what was finished out of paravol progress.
    """
    from app.cli.unfinished_command import run_unfinished

    return run_unfinished(
        session,
        recovers=recover,
        discards=discard,
        keeps=not no_store,
        as_json=json,
    )
