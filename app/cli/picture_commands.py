"""The command that takes pictures.

Nothing heavy is imported here: the command fetches its own modules when it runs.
"""

from dataclasses import replace
from pathlib import Path

from app.cli.root import PICTURES, app, rank_count, thread_count
from app.cli.snapshot_options import NOTHING_TYPED, SnapshotOptions


@app.command(group=PICTURES)
def snapshot(
    session: Path | None = None,
    *,
    options: SnapshotOptions = NOTHING_TYPED,
) -> int:
    """Render high-quality pictures: of a session, a case, a scan or a saved view.

    Ctrl-C takes the best picture so far and says so in its metadata; a second one
    leaves none.

    Parameters
    ----------
    session
        A recorded session; its view at --time is rendered.
    """
    from app.cli.snapshot_command import run_snapshot

    options = replace(
        options,
        session=session,
        ranks=rank_count(options.ranks, oversubscribe=options.oversubscribe),
        threads=thread_count(options.threads),
    )
    return run_snapshot(options)
