"""`paravol scenario`: list the exercises, check a file, show one."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec
from cyclopts import App

from app.cli.root import Json, ScenarioName
from app.cli.terminal import ProgressReporter, print_json, print_table
from system import UserError
from system.typed_record import decode_json

if TYPE_CHECKING:
    from scenarios import Scenario
    from scenarios.ladder import LadderStep
    from scenarios.scenario import Scope
    from scenarios.tasks import Task

RARE = 0.3
"""Pass rate of somebody who is not there yet."""

Results = dict[str, list[bool]]

scenario = App(name="scenario", help="List, check, show and make exercises.")


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
    from scenarios import load_scenario
    from scenarios.ladder import LAST_RUNS, LEAST_RATE, false_unlock, rungs
    from scenarios.scenario import Level, bundled_scenarios

    known: Results = {}
    if results is not None:
        try:
            content = results.read_bytes()
        except OSError as error:
            raise UserError(
                f"The results {results} cannot be read: {error.strerror}."
            ) from error
        known = decode_json(content, Results, results, "results of exercises")
    if trainee is not None:
        from paravol.progress.store import ProgressStore

        known |= ProgressStore().results(trainee)
    exercises = [load_scenario(name)[0] for name in bundled_scenarios()]
    exercises.sort(key=lambda exercise: list(Level).index(exercise.level))
    found = rungs(exercises, known)
    if json:
        print_json(
            [
                {**_told(exercise), "door": rung.door, "bound": rung.bound}
                for exercise, rung in zip(exercises, found, strict=True)
            ]
        )
        return 0
    rows = [
        (exercise.name, f"{exercise.level}: {exercise.title}{_door(rung)}")
        for exercise, rung in zip(exercises, found, strict=True)
    ]
    print_table("Exercises: paravol train --scenario NAME", rows)
    if known:
        print(
            f"Passed: the last {LAST_RUNS} runs show a pass rate of {LEAST_RATE:.0%} "
            "with confidence: three in a row, or five of six. Luck at a rate of "
            f"{RARE:.0%} gets there within ten runs with a probability of "
            f"{false_unlock(RARE, 10):.0%}."
        )
    return 0


@scenario.command
def check(file: Path, *, json: Json = False) -> int:
    """Check an exercise of your own; 1 where it names what its head does not have.

    The message names file, line and the nearest valid word.

    Parameters
    ----------
    file
        A scenario file, NAME.toml; docs/scenarios.md describes its keys.
    """
    from paravol.exercises.exercise_fit import fit_problems
    from paravol.patient import load_patient
    from scenarios import load_scenario
    from scenarios.exercise_check import told

    if file.suffix != ".toml":
        raise UserError(f"A scenario file ends in .toml; got {file}.")
    scenario, _ = load_scenario(str(file))
    with ProgressReporter(quiet=json) as stages:
        patient = load_patient(scenario, stages)
        problems = list(fit_problems(scenario, patient))
    lines = [told(file, file.read_bytes(), problem) for problem in problems]
    if json:
        print_json({"file": str(file), "problems": lines})
    else:
        print("\n".join(lines) or f"{file}: {len(scenario.tasks)} tasks, all in order.")
    return 1 if lines else 0


@scenario.command
def show(name: ScenarioName, *, json: Json = False) -> int:
    """Show what an exercise asks for, and when it is passed."""
    from scenarios import load_scenario

    scenario, _ = load_scenario(name)
    if json:
        print_json(msgspec.to_builtins(scenario))
        return 0
    scope, marks = scenario.scope, scenario.marks
    rows = [
        ("level", scenario.level.value),
        ("about", scenario.about),
        ("head", _head(scenario)),
        ("scope", f"{scope.diameter_mm:g} mm, {scope.angle_deg:g} degrees"),
        ("camera head", _camera(scope)),
        ("tools", ", ".join(scenario.tools)),
        ("needs", ", ".join(scenario.needs)),
        *((f"{_kind(task)}: {task.name}", task.title) for task in scenario.tasks),
        ("passed with", ", ".join(marks.tasks) or "all tasks that are not optional"),
        *(
            (f"  {limit.name}", _limit(limit.least, limit.most))
            for limit in marks.metrics
        ),
    ]
    print_table(scenario.title, [row for row in rows if row[1]])
    return 0


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
    from paravol.exercises.recorded_scenario import scenario_from_session

    with ProgressReporter(quiet=json) as stages:
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


def _told(exercise: "Scenario") -> dict[str, Any]:
    return {
        "name": exercise.name,
        "title": exercise.title,
        "level": exercise.level,
        "needs": exercise.needs,
    }


def _door(rung: "LadderStep") -> str:
    from scenarios.ladder import ExerciseStatus

    if rung.door is ExerciseStatus.LOCKED:
        return f" (after {', '.join(rung.waits)})"
    if rung.runs:
        return f" ({rung.door}; {rung.passes} of the last {rung.runs} runs passed)"
    return ""


def _head(scenario: "Scenario") -> str:
    head = scenario.head
    parts = [head.words(), *head.variants, *head.disease]
    if others := ", ".join(map(str, head.patients[1:])):
        parts.insert(1, f"then {others}")
    for side, grade in (("right", head.polyps_right), ("left", head.polyps_left)):
        if grade:
            parts.append(f"polyps of grade {grade}, {side}")
    return ", ".join([*parts, "decongested"] if head.decongested else parts)


def _camera(scope: "Scope") -> str:
    """Say what turns the camera head; nothing of one that is held upright."""
    from scenarios.scenario import CameraHold

    if scope.camera is CameraHold.UPRIGHT and not scope.camera_roll_deg:
        return ""
    return f"{scope.camera.value}, {scope.camera_roll_deg:g} degrees aslant at first"


def _kind(task: "Task") -> str:
    return str(msgspec.to_builtins(task)["kind"])


def _limit(least: float | None, most: float | None) -> str:
    low = "" if least is None else f"at least {least:g}"
    high = "" if most is None else f"at most {most:g}"
    return " and ".join(part for part in (low, high) if part)
