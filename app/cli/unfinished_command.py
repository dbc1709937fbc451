"""`paravol unfinished`: list what killed flights left, finish it or remove it."""

from pathlib import Path

from app.cli.terminal import Stages, print_json, print_table
from disk import UserError
from paravol.score_table import score_rows
from paravol.session_store import SessionStore
from paravol.unfinished_sessions import (
    UnfinishedSession,
    discard,
    recover,
    unfinished_session,
    unfinished_sessions,
)


def run_unfinished(
    folder: Path | None, *, recovers: bool, discards: bool, keeps: bool, as_json: bool
) -> int:
    """List the user's unfinished flights; or finish, or remove, one or all of them.

    keeps: what was finished in the progress store.
    """
    if recovers and discards:
        raise UserError("Give --recover or --discard, not both.")
    store = SessionStore.of_the_user()
    found = (
        unfinished_sessions(store) if folder is None else [unfinished_session(folder)]
    )
    if discards:
        for session in found:
            discard(session)
            print(f"Removed {session.folder}")
    elif recovers:
        for session in found:
            _recover(session, keeps=keeps)
    elif as_json:
        print_json({"unfinished": [_described(session) for session in found]})
        return 0
    else:
        for session in found:
            print(
                f"{session.folder}\n    {session.title}: {session.length_s:.1f} s, "
                f"begun {session.created}"
            )
        if found:
            print("--recover scores and keeps them, --discard removes them.")
    if not found:
        print("No flight was left unfinished.")
    return 0


def _recover(session: UnfinishedSession, *, keeps: bool) -> None:
    with Stages() as stages:
        score = recover(session, stages)
    print_table(session.title, score_rows(score))
    print(f"Recorded in {session.folder}")
    if keeps:
        from app.cli.train import keep_session

        keep_session(session.folder, "")


def _described(session: UnfinishedSession) -> dict[str, object]:
    return {
        "folder": str(session.folder),
        "title": session.title,
        "created": session.created,
        "length_s": session.length_s,
    }
