"""Whether a run of an exercise was good enough, mark by mark."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from scenarios.metrics import Definition, Metric, definitions_named
from scenarios.metrics.unlisted_tools import UNLISTED
from scenarios.metrics.value_text import value_text
from scenarios.scenario import MetricLimit, Scenario
from scenarios.tasks.engine import Status, TaskState
from scenarios.tasks.task import KeepAway

FAR = "nothing came nearer"
"""How the reason begins why a hazard has no smallest distance: it was never near."""


@dataclass(frozen=True, slots=True)
class PassMark:
    """One mark of an exercise.

    is_met: None where nothing says. why: what was reached, or why nobody knows.
    """

    title: str
    is_met: bool | None
    why: str = ""


def pass_marks(
    scenario: Scenario, tasks: Mapping[str, str], metrics: Sequence[Metric]
) -> list[PassMark]:
    """Return how a run stands to its marks: tasks, metrics, the tools it may use.

    tasks: status of each at the end, by name; empty where nobody followed them.
    metrics: those that were computed. A rubric's percent is not looked at.
    """
    found = []
    for name in needed_tasks(scenario):
        status = tasks.get(name)
        is_done = None if status is None else status == Status.DONE
        found.append(PassMark(name, is_done, "" if status is None else str(status)))
    found += [_limited(limit, metrics) for limit in scenario.marks.metrics]
    if scenario.tools:
        found.append(_limited(MetricLimit(UNLISTED, most=0.0), metrics))
    return found


@dataclass(frozen=True, slots=True)
class DoneShare:
    """How much of what an exercise asks for was done.

    done, asked: how many things, all of it; share: 0 to 1, begun ones in part.
    """

    done: int
    asked: int
    share: float

    @property
    def is_all(self) -> bool:
        """Return whether nothing is left to do."""
        return self.done == self.asked


def done_share(
    scenario: Scenario, tasks: Sequence[TaskState], metrics: Sequence[Metric]
) -> DoneShare | None:
    """Return how much was done of the tasks, and of the places to come near to.

    To keep away from something is no doing: who does nothing does it. None where the
    exercise asks for nothing, or where nobody followed it.
    """
    goals = goals_of(scenario)
    shares = [
        1.0 if state.status is Status.DONE else state.progress * _COUNTS[state.status]
        for state in tasks
        if state.name in goals
    ]
    if len(shares) < len(goals):
        return None
    shares += [
        float(_limited(limit, metrics).is_met or False)
        for limit in scenario.marks.metrics
        if limit.name.startswith("nearest to: ")
    ]
    if not shares:
        return None
    # what is begun is never all of it
    done = sum(share >= 1.0 for share in shares)
    return DoneShare(done, len(shares), math.fsum(shares) / len(shares))


_COUNTS = {Status.WAITING: 0.0, Status.OPEN: 0.99, Status.DONE: 1.0, Status.FAILED: 0.0}
"""Share of its progress that counts of a task, by how it ended."""


def goals_of(scenario: Scenario) -> frozenset[str]:
    """Return the names of the tasks that must be done by doing something."""
    kept = {task.name for task in scenario.tasks if isinstance(task, KeepAway)}
    return frozenset(needed_tasks(scenario)) - kept


def needed_tasks(scenario: Scenario) -> Sequence[str]:
    """Return the names of the tasks that must be done."""
    named = scenario.marks.tasks
    return named or [t.name for t in scenario.tasks if not t.is_optional]


def limited_metrics(scenario: Scenario) -> tuple[Definition, ...]:
    """Return the definitions of the metrics that the exercise's pass mark reads."""
    names = {limit.name.partition(": ")[0] for limit in scenario.marks.metrics}
    if scenario.tools:
        names.add(UNLISTED)
    return definitions_named(names)


def _limited(limit: MetricLimit, metrics: Sequence[Metric]) -> PassMark:
    """Compare a value as it was measured; of several each has to keep the limit."""
    rows = [
        metric
        for metric in metrics
        if (metric.name == limit.name or metric.name.startswith(f"{limit.name}: "))
        and limit.role in ("", metric.role)
    ]
    values = [metric for metric in rows if metric.value is not None]
    if not values:
        if not rows:
            return PassMark(limit.name, None, "not measured")
        is_far = all(row.reason.startswith(FAR) for row in rows)
        is_met = True if is_far and limit.most is None else None
        return PassMark(limit.name, is_met, rows[0].reason)
    worst = max(values, key=lambda metric: _beyond(limit, metric))
    beyond = _beyond(limit, worst)
    assert worst.value is not None
    why = value_text(worst.value, worst.sigma, worst.unit)
    if limit.least is not None:
        why += f", at least {limit.least:g} is asked for"
    if limit.most is not None:
        why += f", at most {limit.most:g} is allowed"
    if worst.sigma and abs(beyond) < worst.sigma:
        why += "; nearer to it than its noise"
    return PassMark(worst.name, beyond <= 0.0, why)


def _beyond(limit: MetricLimit, metric: Metric) -> float:
    """Return how far a value lies outside of the limits; at most 0 within them."""
    assert metric.value is not None
    under = -math.inf if limit.least is None else limit.least - metric.value
    over = -math.inf if limit.most is None else metric.value - limit.most
    return max(under, over)
