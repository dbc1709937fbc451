"""`paravol progress` and its parts: sessions over time.

Nothing heavy is imported here: every command fetches its own modules when it runs.
"""

from pathlib import Path
from typing import Annotated

from cyclopts import App, Parameter

from app.cli.root import SESSIONS, Flag, Json, app

progress = App(
    name="progress",
    help="Follow progress over time: learning curves, a cohort, exports.",
    group=SESSIONS,
)
app.command(progress)

Store = Annotated[
    Path | None,
    Parameter(help="The store's file; the user's own when left out."),
]
Trainee = Annotated[
    str | None,
    Parameter(help='Only of this made-up name; "" is whoever gave none.'),
]
Exercise = Annotated[str | None, Parameter(help="Only of this exercise.")]
Figure = Annotated[
    str,
    Parameter(
        help="Name of a metric, or percent for the rubric's points; the role may "
        "stand before it, as in scope:path length."
    ),
]


@progress.default
def show(
    *,
    trainee: Trainee = None,
    figure: Figure = "",
    store: Store = None,
    json: Json = False,
) -> int:
    """Tell how each exercise goes: attempts, passes, best, what the next may give."""
    from app.cli.progress_command import run_show

    return run_show(store, trainee, figure, as_json=json)


progress.command(show)


@progress.command(name="list")
def list_sessions(
    *,
    trainee: Trainee = None,
    exercise: Exercise = None,
    store: Store = None,
    json: Json = False,
) -> int:
    """List the sessions that are kept, the oldest first."""
    from app.cli.progress_command import run_list

    return run_list(store, trainee, exercise, as_json=json)


@progress.command
def curve(
    exercise: str,
    *,
    figure: Figure = "",
    trainee: str = "",
    out: Path | None = None,
    store: Store = None,
    json: Json = False,
) -> int:
    """Fit a learning curve to a trainee's attempts at an exercise.

    Parameters
    ----------
    exercise
        Its name, as listed.
    trainee
        The made-up name; without it, whoever gave none.
    out
        Draw it into this .png or .svg file.
    """
    from app.cli.progress_command import run_curve

    return run_curve(store, exercise, figure, trainee, out, as_json=json)


@progress.command
def cohort(
    *,
    figure: Figure = "",
    exercise: Exercise = None,
    store: Store = None,
    json: Json = False,
) -> int:
    """Set all trainees beside one another: median, best, passes, percentile."""
    from app.cli.progress_command import run_cohort

    return run_cohort(store, figure, exercise, as_json=json)


@progress.command
def export(
    *,
    csv: Path | None = None,
    xapi: Path | None = None,
    home_page: str = "",
    trainee: Trainee = None,
    exercise: Exercise = None,
    store: Store = None,
) -> int:
    """Write sessions as a table, or as statements for a learning record store.

    Parameters
    ----------
    csv
        Write a row for each figure of each session.
    xapi
        Write xAPI 1.0.3 statements as one JSON array.
    home_page
        With --xapi: URL of whoever gave out the names, such as your school's.
    """
    from app.cli.progress_command import run_export

    return run_export(store, csv, xapi, home_page, trainee, exercise)


@progress.command
def add(
    *sessions: Path,
    trainee: str = "",
    rubric: str = "",
    assessment: Path | None = None,
    motion_only: Flag = False,
    store: Store = None,
    json: Json = False,
) -> int:
    """Add recorded sessions; one that is there already is replaced.

    Parameters
    ----------
    sessions
        Folders NAME.paravol.
    trainee
        A name that the trainee made up. None is needed.
    rubric
        Score them by this bundled rubric, such as endoscopy, or a .toml file; by
        itself "operation" or, where nothing was cut, "endoscopy".
    assessment
        JSON file of the session's assessment by a rubric; for one session only.
    motion_only
        Leave the head out: no contact, hazards, removal or score, but at once.
    """
    from app.cli.progress_command import run_add

    return run_add(
        store,
        sessions,
        trainee,
        assessment,
        rubric=rubric,
        motion_only=motion_only,
        as_json=json,
    )


@progress.command
def delete(
    *sessions: str,
    trainee: Trainee = None,
    everything: Flag = False,
    recordings: Flag = False,
    recordings_in: tuple[Path, ...] = (),
    yes: Flag = False,
    store: Store = None,
) -> int:
    """Delete sessions for good; without --yes only say which.

    Parameters
    ----------
    sessions
        Names of recordings or beginnings of hashes, as listed.
    trainee
        All sessions of this name, and the name.
    everything
        All sessions of everybody.
    recordings
        Delete the recordings, too, where they lie below the user's data directory.
    recordings_in
        Delete them in this folder, too; may be given several times.
    yes
        Really delete.
    """
    from app.cli.progress_command import DeleteOptions, run_delete

    return run_delete(
        store,
        DeleteOptions(sessions, trainee, everything, recordings, recordings_in),
        really=yes,
    )
