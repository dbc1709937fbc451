"""`paravol unfinished`: list what killed flights left, finish it or remove it."""

from pathlib import Path
from typing import TYPE_CHECKING

from app.cli.root import Flag, Json
from app.cli.terminal import ProgressReporter, print_json, print_table
from paravol.sessions.session_store import SessionStore
from system import UserError

if TYPE_CHECKING:
    from paravol.sessions.unfinished_sessions import UnfinishedSession


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
    from paravol.sessions import unfinished_sessions as sessions

    if recover and discard:
        raise UserError("Give --recover or --discard, not both.")
    store = SessionStore.of_the_user()
    found = (
        sessions.unfinished_sessions(store)
        if session is None
        else [sessions.unfinished_session(session)]
    )
    if discard:
        for each in found:
            sessions.discard(each)
            print(f"Removed {each.folder}")
    elif recover:
        for each in found:
            _recover(each, keeps=not no_store)
    elif json:
        print_json({"unfinished": [_described(each) for each in found]})
        return 0
    else:
        for each in found:
            print(
                f"{each.folder}\n    {each.title}: {each.length_s:.1f} s, "
                f"begun {each.created}"
            )
        if found:
            print("--recover scores and keeps them, --discard removes them.")
    if not found:
        print("No flight was left unfinished.")
    return 0


def _recover(session: "UnfinishedSession", *, keeps: bool) -> None:
    from paravol.scoring.score_table import score_rows
    from paravol.sessions import unfinished_sessions as sessions

    with ProgressReporter() as stages:
        score = sessions.recover(session, stages)
    print_table(session.title, score_rows(score))
    print(f"Recorded in {session.folder}")
    if keeps:
        from app.cli.train import keep_session

        keep_session(session.folder, "")


def _described(session: "UnfinishedSession") -> dict[str, object]:
    return {
        "folder": str(session.folder),
        "title": session.title,
        "created": session.created,
        "length_s": session.length_s,
    }
