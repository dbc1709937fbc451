"""Whether an exercise was passed: its tasks, its limits on metrics, its percent."""

from collections.abc import Iterator, Sequence

from scenarios.metrics import Definition, definitions_named
from scenarios.metrics.metric import Metric
from scenarios.rubrics.assessment import ExerciseMark, Verdict
from scenarios.scenario import MetricLimit, Scenario
from scenarios.tasks import TaskState
from scenarios.tasks.engine import Status

FAR = "nothing came nearer"
"""How the reason begins why a hazard has no smallest distance: it was never near."""

_Answer = tuple[bool | None, str]
"""Whether something that is asked for was met, None where nothing says; and why."""


def limited_metrics(scenario: Scenario) -> tuple[Definition, ...]:
    """Return the definitions of the metrics that the exercise's pass mark bounds."""
    names = {limit.name.partition(": ")[0] for limit in scenario.marks.metrics}
    return definitions_named(names)


def exercise_mark(
    scenario: Scenario,
    tasks: Sequence[TaskState],
    metrics: Sequence[Metric],
    percent: float | None,
) -> ExerciseMark | None:
    """Judge a session by the pass mark of its own exercise; None where it has none.

    tasks: their states; none where the session did not get to its end. percent: of a
    rubric's points. Limits are compared with values as they were measured; a value
    nearer to its limit than its noise says so. One thing that was not met is enough not
    to pass; where nothing was missed but something is unknown, there is no verdict.
    """
    answers = [
        *_of_tasks(scenario, tasks),
        *(_of_limit(limit, metrics) for limit in scenario.marks.metrics),
        *_of_percent(scenario.marks.least_percent, percent),
    ]
    if not answers:
        return None
    met = [answer for answer, _ in answers]
    verdict = Verdict.PASSED
    if False in met:
        verdict = Verdict.NOT_PASSED
    elif None in met:
        verdict = Verdict.NO_DATA
    missed = tuple(why for is_met, why in answers if not is_met)
    kept = tuple(why for is_met, why in answers if is_met)
    return ExerciseMark(verdict, missed, kept)


def _of_tasks(scenario: Scenario, states: Sequence[TaskState]) -> Iterator[_Answer]:
    needed = scenario.marks.tasks or [
        task.name for task in scenario.tasks if not task.is_optional
    ]
    known = {state.name: state for state in states}
    for name in needed:
        state = known.get(name)
        if state is None:
            yield None, f"it is not known whether the task {name!r} was done"
            continue
        why = f": {state.why}" if state.why else ""
        yield state.status is Status.DONE, f"the task {name!r} is {state.status}{why}"


def _of_limit(limit: MetricLimit, metrics: Sequence[Metric]) -> _Answer:
    rows = [
        metric
        for metric in metrics
        if (metric.name == limit.name or metric.name.startswith(f"{limit.name}: "))
        and limit.role in ("", metric.role)
    ]
    values = [metric for metric in rows if metric.value is not None]
    if not values:
        is_far = bool(rows) and all(row.reason.startswith(FAR) for row in rows)
        if is_far and limit.most is None:
            return True, f"{limit.name}: {rows[0].reason}"
        why = rows[0].reason if rows else "not enough data: it was not measured"
        return None, f"{limit.name}: {why}"
    # of several, such as one for each hazard, each has to keep within the limit
    worst = max(values, key=lambda metric: _beyond(limit, metric))
    value, unit = worst.value or 0.0, "" if worst.unit in ("1", "count") else worst.unit
    beyond = _beyond(limit, worst)
    bounds = [
        f"{word} {bound:g}{f' {unit}' if unit else ''}"
        for word, bound in (("at least", limit.least), ("at most", limit.most))
        if bound is not None
    ]
    told = f"{worst.name} is {value:.4g}{f' {unit}' if unit else ''}"
    sigma = f" ± {worst.sigma:.2g}" if worst.sigma else ""
    near = ""
    if worst.sigma and abs(beyond) < worst.sigma:
        near = ", nearer to the limit than its noise"
    return beyond <= 0.0, f"{told}{sigma}, asked for is {' and '.join(bounds)}{near}"


def _beyond(limit: MetricLimit, metric: Metric) -> float:
    """Return how far a value lies outside of the limits; below 0 inside."""
    assert metric.value is not None
    under = float("-inf") if limit.least is None else limit.least - metric.value
    over = float("-inf") if limit.most is None else metric.value - limit.most
    return max(under, over)


def _of_percent(least: float, percent: float | None) -> Iterator[_Answer]:
    if least <= 0.0:
        return
    if percent is None:
        yield None, f"no rubric gave a percent, of which {least:g} are asked for"
        return
    told = f"{percent:.1f} % of the rubric's points, asked for are {least:g} %"
    yield percent >= least, told
