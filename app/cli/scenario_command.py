"""`paravol scenario`: list the exercises, check a file, show one."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec

from app.cli.terminal import Stages, print_json, print_table
from disk import UserError
from disk.typed_record import decode_json
from scenarios import Scenario, load_scenario
from scenarios.exercise_check import told
from scenarios.ladder import LAST_RUNS, LEAST_RATE, Door, Rung, false_unlock, rungs
from scenarios.scenario import CameraHold, Level, Scope, bundled_scenarios
from scenarios.tasks import Task

RARE = 0.3
"""Pass rate of somebody who is not there yet."""

Results = dict[str, list[bool]]


@dataclass(frozen=True, slots=True)
class ListOptions:
    """Hold what was asked for; see `paravol scenario list --help`."""

    results: Path | None = None
    trainee: str | None = None


def run_list(options: ListOptions, *, as_json: bool) -> int:
    """Print the bundled exercises, and which of them results have opened."""
    results: Results = {}
    if options.results is not None:
        try:
            content = options.results.read_bytes()
        except OSError as error:
            raise UserError(
                f"The results {options.results} cannot be read: {error.strerror}."
            ) from error
        results = decode_json(content, Results, options.results, "results of exercises")
    if options.trainee is not None:
        from paravol.progress.store import ProgressStore

        results |= ProgressStore().results(options.trainee)
    exercises = [load_scenario(name)[0] for name in bundled_scenarios()]
    exercises.sort(key=lambda exercise: list(Level).index(exercise.level))
    found = rungs(exercises, results)
    if as_json:
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
    if results:
        print(
            f"Passed: the last {LAST_RUNS} runs show a pass rate of {LEAST_RATE:.0%} "
            "with confidence: three in a row, or five of six. Luck at a rate of "
            f"{RARE:.0%} gets there within ten runs with a probability of "
            f"{false_unlock(RARE, 10):.0%}."
        )
    return 0


def run_check(file: Path, *, as_json: bool) -> int:
    """Check an exercise's file against its schema, the catalogue and its head."""
    from paravol.exercise_fit import fit_problems
    from paravol.patient import load_patient

    if file.suffix != ".toml":
        raise UserError(f"A scenario file ends in .toml; got {file}.")
    scenario, _ = load_scenario(str(file))
    with Stages(quiet=as_json) as stages:
        patient = load_patient(scenario, stages)
        problems = list(fit_problems(scenario, patient))
    lines = [told(file, file.read_bytes(), problem) for problem in problems]
    if as_json:
        print_json({"file": str(file), "problems": lines})
    else:
        print("\n".join(lines) or f"{file}: {len(scenario.tasks)} tasks, all in order.")
    return 1 if lines else 0


def run_show(name: str, *, as_json: bool) -> int:
    """Print what an exercise asks for."""
    scenario, _ = load_scenario(name)
    if as_json:
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


def _told(exercise: Scenario) -> dict[str, Any]:
    return {
        "name": exercise.name,
        "title": exercise.title,
        "level": exercise.level,
        "needs": exercise.needs,
    }


def _door(rung: Rung) -> str:
    if rung.door is Door.LOCKED:
        return f" (after {', '.join(rung.waits)})"
    if rung.runs:
        return f" ({rung.door}; {rung.passes} of the last {rung.runs} runs passed)"
    return ""


def _head(scenario: Scenario) -> str:
    head = scenario.head
    if head.case or head.scene:
        return head.case or f"scene {head.scene}, seed {head.seed}"
    parts = [f"phantom of seed {head.seed}", *head.variants, *head.disease]
    for side, grade in (("right", head.polyps_right), ("left", head.polyps_left)):
        if grade:
            parts.append(f"polyps of grade {grade}, {side}")
    return ", ".join([*parts, "decongested"] if head.decongested else parts)


def _camera(scope: Scope) -> str:
    """Say what turns the camera head; nothing of one that is held upright."""
    if scope.camera is CameraHold.UPRIGHT and not scope.camera_roll_deg:
        return ""
    return f"{scope.camera.value}, {scope.camera_roll_deg:g} degrees aslant at first"


def _kind(task: Task) -> str:
    return str(msgspec.to_builtins(task)["kind"])


def _limit(least: float | None, most: float | None) -> str:
    low = "" if least is None else f"at least {least:g}"
    high = "" if most is None else f"at most {most:g}"
    return " and ".join(part for part in (low, high) if part)
