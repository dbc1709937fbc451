"""Follow the tasks of an exercise, sample by sample.

It asks no clock: the same situations give the same events, whatever machine steps them.
"""

import copy
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from scenarios.tasks.checks import order_problems, place_problems, sentence
from scenarios.tasks.head_parts import Head
from scenarios.tasks.rules import Rule, rule_of
from scenarios.tasks.situation import Situation
from scenarios.tasks.task import Task
from system import UserError


class Status(StrEnum):
    """How a task stands."""

    WAITING = "waiting"
    OPEN = "open"
    DONE = "done"
    FAILED = "failed"


@dataclass(frozen=True, slots=True)
class TaskState:
    """How one task stands.

    progress: 0 to 1. opened_s, ended_s: of the score's clock, None before. why: it
    failed, or what is left to do, in words.
    """

    name: str
    status: Status = Status.WAITING
    progress: float = 0.0
    opened_s: float | None = None
    ended_s: float | None = None
    why: str = ""


@dataclass(frozen=True, slots=True)
class TaskEvent:
    """Tell that a task was opened, done or failed, and when."""

    time_s: float
    task: str
    status: Status
    text: str


@dataclass(frozen=True, slots=True)
class EngineState:
    """An engine between two samples; see `TaskEngine.checkpoint`."""

    rules: tuple[Rule, ...]
    states: tuple[TaskState, ...]
    last_s: float | None


class TaskEngine:
    """Open tasks in their order, and tell which are done.

    states: how each task stands, in the order of the scenario.
    """

    def __init__(
        self,
        tasks: Sequence[Task],
        places: Mapping[str, NDArray[np.float64]],
        head: Head | None = None,
    ) -> None:
        """Begin an exercise.

        places: ``(3,)`` LPS mm of the head's landmarks by name. head: as before anybody
        operated, see `rule_of`. UserError names a place, or a task in `after`, that
        there is not.
        """
        check_tasks(tasks, places)
        self.tasks = tuple(tasks)
        self._rules = [rule_of(task, places, head) for task in tasks]
        self.states = tuple(TaskState(task.name) for task in tasks)
        self._last_s: float | None = None

    def step(self, now: Situation) -> list[TaskEvent]:
        """Take in one situation; return what happened. They come in order of time."""
        elapsed_s = 0.0 if self._last_s is None else now.time_s - self._last_s
        self._last_s = now.time_s
        states, events = list(self.states), []
        done = {s.name for s in states if s.status is Status.DONE}
        for n, (task, rule) in enumerate(zip(self.tasks, self._rules, strict=True)):
            state = states[n]
            if state.status is Status.WAITING and done.issuperset(task.after):
                state = TaskState(task.name, Status.OPEN, 0.0, now.time_s)
                events.append(TaskEvent(now.time_s, task.name, Status.OPEN, task.title))
            if state.status is Status.OPEN:
                rule.step(now, elapsed_s if state.opened_s != now.time_s else 0.0)
                state = _stepped(state, rule, now.time_s)
                if state.status is not Status.OPEN:
                    text = state.why or task.title
                    events.append(TaskEvent(now.time_s, task.name, state.status, text))
            states[n] = state
        self.states = tuple(states)
        return events

    @property
    def is_complete(self) -> bool:
        """Return whether nothing is left to do: all that count are done, or kept."""
        return all(
            task.is_optional
            or state.status is Status.DONE
            or (rule.is_kept and state.status is Status.OPEN)
            for task, state, rule in zip(
                self.tasks, self.states, self._rules, strict=True
            )
        )

    def ended(self) -> tuple[TaskState, ...]:
        """Return how each task stands if this is the end: what was kept is done."""
        return tuple(
            TaskState(s.name, Status.DONE, 1.0, s.opened_s, self._last_s)
            if rule.is_kept and s.status is Status.OPEN
            else s
            for s, rule in zip(self.states, self._rules, strict=True)
        )

    def checkpoint(self) -> EngineState:
        """Return all that later samples may change."""
        rules = tuple(copy.copy(rule) for rule in self._rules)
        return EngineState(rules, self.states, self._last_s)

    def restore(self, state: EngineState) -> None:
        """Go back, or on, to a state of this engine."""
        self._rules = [copy.copy(rule) for rule in state.rules]
        self.states = state.states
        self._last_s = state.last_s


def check_tasks(tasks: Sequence[Task], places: Collection[str]) -> None:
    """Raise UserError where a task names what there is not."""
    for problem in chain(order_problems(tasks), place_problems(tasks, places)):
        raise UserError(sentence(problem))


def _stepped(state: TaskState, rule: Rule, time_s: float) -> TaskState:
    status, ended_s = Status.OPEN, None
    if rule.failed:
        status, ended_s = Status.FAILED, time_s
    elif rule.progress >= 1.0 and not rule.is_kept:
        status, ended_s = Status.DONE, time_s
    why = rule.failed or ("" if status is Status.DONE else rule.lacks)
    return TaskState(state.name, status, rule.progress, state.opened_s, ended_s, why)
