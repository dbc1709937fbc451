"""Whether a run of an exercise was good enough, mark by mark."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from scenarios.metrics import Metric
from scenarios.metrics.unlisted_tools import UNLISTED
from scenarios.scenario import MetricLimit, Scenario
from scenarios.tasks.engine import Status


@dataclass(frozen=True, slots=True)
class PassMark:
    """Hold one mark of an exercise.

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
    needed = scenario.marks.tasks or [
        t.name for t in scenario.tasks if not t.is_optional
    ]
    found = []
    for name in needed:
        status = tasks.get(name)
        is_done = None if status is None else status == Status.DONE
        found.append(PassMark(name, is_done, "" if status is None else str(status)))
    found += [_limited(limit, metrics) for limit in scenario.marks.metrics]
    if scenario.tools:
        found.append(_limited(MetricLimit(UNLISTED, most=0.0), metrics))
    return found


def _limited(limit: MetricLimit, metrics: Sequence[Metric]) -> PassMark:
    rows = [m for m in metrics if m.name == limit.name and limit.role in ("", m.role)]
    if not rows:
        return PassMark(limit.name, None, "not measured")
    metric = rows[0]
    if metric.value is None:
        return PassMark(limit.name, None, metric.reason)
    is_low = limit.least is not None and metric.value < limit.least
    is_high = limit.most is not None and metric.value > limit.most
    unit = "" if metric.unit in ("1", "count") else f" {metric.unit}"
    why = f"{metric.value:.4g}{unit}"
    if is_low:
        why += f", at least {limit.least:g} is asked for"
    if is_high:
        why += f", at most {limit.most:g} is allowed"
    return PassMark(limit.name, not (is_low or is_high), why)
