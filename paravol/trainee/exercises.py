"""The exercises as a trainee sees them: what is open, was done, and comes next."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from scenarios import Scenario, load_scenario
from scenarios.ladder import ExerciseStatus, LadderStep, rungs
from scenarios.passing import goals_of
from scenarios.scenario import CURRICULUM, Level, bundled_scenarios
from scenarios.tasks import Status
from scenarios.tasks.task import (
    Follow,
    Hold,
    Inject,
    KeepAway,
    LookTask,
    Open,
    Reach,
    Remove,
    Survey,
    Task,
)

if TYPE_CHECKING:
    # loads a database, which takes longer than to list what can be flown
    from paravol.progress.session_entry import SessionEntry

_LEARNT: tuple[tuple[type[Task], str], ...] = (
    (LookTask, "find a place and keep it in the middle of the picture"),
    (Hold, "hold the scope still"),
    (Follow, "lead the tip along a way"),
    (Reach, "bring a tip to a place"),
    (Survey, "look at all of the mucosa"),
    (Inject, "inject into the mucosa, not too deep"),
    (Remove, "take what is to be taken, and leave the rest"),
    (Open, "open a way and see that it is open"),
    (KeepAway, "keep away from what must not be hurt"),
)


@dataclass(frozen=True, slots=True)
class Exercise:
    """An exercise and how a trainee stands in it.

    rung: None for what belongs to no ladder, which is always open. waits: titles of
    exercises to be passed before. attempts: in order of time.
    """

    scenario: Scenario
    rung: LadderStep | None
    waits: tuple[str, ...]
    attempts: "tuple[SessionEntry, ...]"

    @property
    def name(self) -> str:
        """Return the name that `load_scenario` knows it by."""
        return self.scenario.name

    @property
    def door(self) -> ExerciseStatus:
        """Return whether it is locked, open or passed."""
        return ExerciseStatus.OPEN if self.rung is None else self.rung.door

    @property
    def best_percent(self) -> float | None:
        """Return the most points, in percent, of attempts that were not failed.

        None without any: who leaves at once hurts nothing, and has most of the points.
        """
        valid = [entry for entry in self.attempts if entry.has_passed is not False]
        found = [p for p in map(percent_of, valid) if p is not None]
        return max(found, default=None)

    @property
    def standing(self) -> str:
        """Return how it stands, in a few words."""
        if self.door is ExerciseStatus.LOCKED:
            return "locked"
        if self.door is ExerciseStatus.PASSED:
            return "passed"
        if self.rung is None or not self.attempts:
            return "open"
        return f"open, {self.rung.passes} of {self.rung.runs} passed"


@dataclass(frozen=True, slots=True)
class Ladder:
    """The curriculum's exercises in their order, and those outside it."""

    exercises: tuple[Exercise, ...]
    others: tuple[Exercise, ...]

    def find(self, name: str) -> Exercise | None:
        """Return an exercise by name; None where there is none."""
        every = [*self.exercises, *self.others]
        return next((e for e in every if e.name == name), None)

    def worth_doing(self, last: str = "") -> Exercise:
        """Return what to do next.

        last: name of what was flown last. It is gone on with until it is passed; then
        comes the first exercise of the ladder that is open. Where all are passed, the
        last one is kept up.
        """
        found = self.find(last)
        if (
            found is not None
            and found.rung is not None
            and found.door is ExerciseStatus.OPEN
        ):
            return found
        for exercise in self.exercises:
            if exercise.door is ExerciseStatus.OPEN:
                return exercise
        return found or self.exercises[-1]


def percent_of(entry: "SessionEntry") -> float | None:
    """Return an attempt's points in percent; None where it has none."""
    return None if entry.scored is None else entry.scored.percent


def attempt_text(entry: "SessionEntry", scenario: Scenario) -> str:
    """Return how an attempt ended, in a word: tasks done, or points when it passed.

    scenario: the exercise; what only asks to keep away from something is not counted.
    """
    percent = percent_of(entry)
    points = "" if percent is None else f"{percent:.0f}"
    if entry.has_passed is False and entry.tasks:
        uncounted = {task.name for task in scenario.tasks} - goals_of(scenario)
        ends = [end for name, end in entry.tasks.items() if name not in uncounted]
        return f"✗ {ends.count(Status.DONE)}/{len(ends)}"
    marks = {True: "✓ ", False: "✗ ", None: ""}
    return f"{marks[entry.has_passed]}{points}".strip()


def ladder_of(sessions: "Iterable[SessionEntry]") -> Ladder:
    """Return the ladder of whoever flew these sessions, in order of time."""
    loaded = [load_scenario(name)[0] for name in bundled_scenarios()]
    inside = {file.stem for file in CURRICULUM.glob("*.toml")}
    curriculum = in_order([s for s in loaded if s.name in inside])
    attempts: dict[str, list[SessionEntry]] = {}
    for entry in sessions:
        attempts.setdefault(entry.exercise, []).append(entry)
    results = {
        name: [e.has_passed for e in entries if e.has_passed is not None]
        for name, entries in attempts.items()
    }
    titles = {s.name: short_title(s) for s in loaded}
    exercises = tuple(
        Exercise(
            scenario,
            rung,
            tuple(titles.get(name, name) for name in rung.waits),
            tuple(attempts.get(scenario.name, ())),
        )
        for scenario, rung in zip(curriculum, rungs(curriculum, results), strict=True)
    )
    others = tuple(
        Exercise(s, None, (), tuple(attempts.get(s.name, ())))
        for s in loaded
        if s.name not in inside
    )
    return Ladder(exercises, others)


def in_order(exercises: Sequence[Scenario]) -> list[Scenario]:
    """Return exercises so that each comes after those it needs, by level and name."""
    known = {exercise.name: exercise for exercise in exercises}
    depths: dict[str, int] = {}

    def depth(name: str) -> int:
        """Return how many exercises come before one, at the longest."""
        if name not in depths:
            depths[name] = 0  # a circle ends here
            needs = [need for need in known[name].needs if need in known]
            depths[name] = max((depth(need) + 1 for need in needs), default=0)
        return depths[name]

    levels = list(Level)
    return sorted(
        exercises, key=lambda e: (levels.index(e.level), depth(e.name), e.name)
    )


def short_title(scenario: Scenario) -> str:
    """Return a title without what follows its colon."""
    return scenario.title.partition(":")[0]


def learns(scenario: Scenario) -> list[str]:
    """Return what one learns in an exercise, in a few words each."""
    found = [
        words
        for kind, words in _LEARNT
        if any(isinstance(task, kind) for task in scenario.tasks)
    ]
    angle = scenario.scope.angle_deg
    if angle:
        found.append(f"look around with a scope of {angle:g}°")
    return found or ["find the way with a scope"]
