"""Commands about exercises: names, options, help."""

from pathlib import Path

from cyclopts import App

from app.cli.root import FLY, Json, ScenarioName, app

scenario = App(name="scenario", help="List, check and show exercises.", group=FLY)
app.command(scenario)


@scenario.command(name="list")
def list_exercises(*, results: Path | None = None, json: Json = False) -> int:
    """List the bundled exercises with their levels, and what they need.

    Parameters
    ----------
    results
        JSON file of earlier results by exercise, oldest first, such as
        {"hoops": [true, true]}: says which exercises they open.
    """
    from app.cli.scenario_command import ListOptions, run_list

    return run_list(ListOptions(results), as_json=json)


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
