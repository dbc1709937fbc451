"""What is open to a trainee, and what comes next."""

import random

import msgspec

from paravol.progress.session_entry import SessionEntry
from paravol.trainee.exercises import (
    attempt_text,
    in_order,
    ladder_of,
    learns,
    short_title,
)
from scenarios import load_scenario
from scenarios.ladder import ExerciseStatus
from scenarios.passing import goals_of
from scenarios.scenario import CURRICULUM, Level
from tests.paravol.progress.learners import entry


def passed(exercise: str, runs: int = 3) -> list[SessionEntry]:
    return [
        entry(number=n, exercise=exercise, percent=80.0 + n, has_passed=True)
        for n in range(1, runs + 1)
    ]


def test_each_exercise_stands_after_those_it_needs() -> None:
    exercises = [load_scenario(str(file))[0] for file in CURRICULUM.glob("*.toml")]
    ordered = in_order(exercises)
    for seed in range(5):
        shuffled = exercises.copy()
        random.Random(seed).shuffle(shuffled)
        assert in_order(shuffled) == ordered
    names = [exercise.name for exercise in ordered]
    assert sorted(names) == sorted(exercise.name for exercise in exercises)
    levels = [list(Level).index(exercise.level) for exercise in ordered]
    assert levels == sorted(levels)
    for place, exercise in enumerate(ordered):
        for need in exercise.needs:
            assert names.index(need) < place, (exercise.name, need)


def test_whoever_flew_nothing_begins_with_what_needs_nothing() -> None:
    ladder = ladder_of([])
    assert ladder.worth_doing() is ladder.exercises[0]
    for exercise in ladder.exercises:
        is_locked = exercise.door is ExerciseStatus.LOCKED
        assert is_locked == bool(exercise.scenario.needs)
        assert bool(exercise.waits) == is_locked
        assert exercise.attempts == ()
        assert exercise.best_percent is None
        assert learns(exercise.scenario)
    assert {e.name for e in ladder.others} >= {"first_flight"}
    assert all(e.door is ExerciseStatus.OPEN for e in ladder.others)


def test_an_exercise_is_gone_on_with_until_it_is_passed() -> None:
    twice = ladder_of(passed("hoops", 2))
    assert twice.worth_doing("hoops").name == "hoops"
    often = ladder_of(passed("hoops"))
    found = often.find("hoops")
    assert found is not None
    assert (found.door, found.best_percent) == (ExerciseStatus.PASSED, 83.0)
    assert often.worth_doing("hoops").name == "centring"
    assert often.worth_doing("no such exercise").name == "centring"
    both = ladder_of(passed("hoops") + passed("centring"))
    opened = both.find("path-following")
    assert opened is not None
    assert opened.door is ExerciseStatus.OPEN


def test_where_all_is_passed_the_last_one_is_kept_up() -> None:
    names = [e.name for e in ladder_of([]).exercises]
    every = ladder_of([run for name in names for run in passed(name)])
    assert {e.door for e in every.exercises} == {ExerciseStatus.PASSED}
    assert every.worth_doing("polypectomy").name == "polypectomy"
    assert every.worth_doing().name == names[-1]


def test_a_flight_that_failed_is_never_the_best() -> None:
    """Who leaves at once hurts nothing, and so has nearly all points."""
    runs = [
        entry(number=1, percent=99.0, has_passed=False),
        entry(number=2, percent=70.0, has_passed=True),
    ]
    found = ladder_of(runs).find("hoops")
    assert found is not None
    assert found.best_percent == 70.0
    assert [attempt_text(run, found.scenario) for run in runs] == ["✗ 1/2", "✓ 70"]


def test_what_was_kept_away_from_is_no_task_done() -> None:
    """An untouched uncinectomy had one of its three tasks done."""
    scenario, _ = load_scenario("uncinectomy")
    tasks = {task.name: "open" for task in scenario.tasks} | {"safe": "done"}
    run = msgspec.structs.replace(entry(has_passed=False), tasks=tasks)
    assert attempt_text(run, scenario) == f"✗ 0/{len(goals_of(scenario))}"


def test_a_title_is_short_without_its_explanation() -> None:
    assert short_title(load_scenario("centring")[0]) == "Centring"
