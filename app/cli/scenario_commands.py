"""Commands about exercises: names, options, help."""

from pathlib import Path

from cyclopts import App

from app.cli.root import FLY, Json, ScenarioName, app

scenario = App(name="scenario", help="List, check, show and make exercises.", group=FLY)
app.command(scenario)


@scenario.command(name="list")
def list_exercises(
    *, results: Path | None = None, trainee: str | None = None, json: Json = False
) -> int:
    """List the bundled exercises with their levels, and what they need.

    Parameters
    ----------
    results
        JSON file of earlier results by exercise, oldest first, such as
        {"hoops": [true, true]}: says which exercises they open.
    trainee
        Take the results from paravol progress, of this made-up name; "" is whoever
        gave none.
    """
    from app.cli.scenario_command import ListOptions, run_list

    return run_list(ListOptions(results, trainee), as_json=json)


@scenario.command
def check(file: Path, *, json: Json = False) -> int:
    """Check an exercise of your own; 1 where it names what its head does not have.

    The message names file, line and the nearest valid word.

    Parameters
    ----------
    file
        A scenario file, NAME.toml; docs/scenarios.md describes its keys.
    """
    from app.cli.scenario_command import run_check

    return run_check(file, as_json=json)


@scenario.command
def show(name: ScenarioName, *, json: Json = False) -> int:
    """Show what an exercise asks for, and when it is passed."""
    from app.cli.scenario_command import run_show

    return run_show(name, as_json=json)


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
