"""The commands of whoever teaches: notes on recordings, exercises from them.

Nothing heavy is imported here: every command fetches its own modules when it runs.
"""

from pathlib import Path

from cyclopts import App

from app.cli.root import SESSIONS, Json, app

scenario = App(
    name="scenario", help="Make an exercise from a recording.", group=SESSIONS
)
app.command(scenario)


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


@scenario.command(name="from-path")
def from_path(
    session: Path,
    *,
    out: Path,
    name: str = "",
    title: str = "",
    case: Path | None = None,
    json: Json = False,
) -> int:
    """Make an exercise from a recording: hoops along its way, stops where it paused.

    Writes NAME.toml and NAME.path.json; fly it with paravol train --scenario NAME.toml.

    Parameters
    ----------
    session
        A folder NAME.paravol.
    out
        Folder for both files.
    name
        Of the exercise and its files; the recording's when left out.
    title
        What a trainee reads.
    case
        Where the case that was flown through lies now.
    """
    from app.cli.terminal import Stages, print_json, print_table
    from paravol.recorded_scenario import scenario_from_session

    with Stages(quiet=json) as stages:
        made = scenario_from_session(
            session, out, name=name, title=title, case=case, progress=stages
        )
    if json:
        told = {"scenario": str(made.file), "path": str(made.path_file)}
        print_json({**told, "hoops": made.hoops, "stops": made.stops})
        return 0
    rows = [
        ("exercise", str(made.file)),
        ("path", f"{made.path_file}, {made.duration_s:.1f} s"),
        ("hoops", str(made.hoops)),
        ("stops", str(made.stops)),
    ]
    print_table(f"Exercise from {session.name}", rows)
    return 0
