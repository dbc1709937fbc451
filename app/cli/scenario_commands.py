"""Commands about exercises: names, options, help."""

from pathlib import Path

from cyclopts import App

from app.cli.root import FLY, Json, app

scenario = App(name="scenario", help="Make exercises from recordings.", group=FLY)
app.command(scenario)


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
