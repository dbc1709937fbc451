"""Score a session by a rubric: a pure function of metrics, tasks and figures."""

import difflib
import math
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import msgspec

from scenarios.metrics.hazard import NEARNESS
from scenarios.metrics.metric import Interval, Metric
from scenarios.metrics.value_text import value_text
from scenarios.passing import FAR, DoneShare, done_share
from scenarios.rubrics.assessment import (
    Assessment,
    Band,
    ExerciseMark,
    HardFail,
    RubricPart,
    Standing,
    Verdict,
)
from scenarios.rubrics.exercise_mark import exercise_mark
from scenarios.rubrics.points import percent_of, percent_sigma
from scenarios.rubrics.population import Population
from scenarios.rubrics.rubric import (
    ANY_TASK,
    FIGURES,
    MOST_REMOVAL_PERCENT,
    Combine,
    FailRule,
    Item,
    Rubric,
    Source,
)
from scenarios.scenario import Scenario
from scenarios.scoring import OperationFigures
from scenarios.tasks import TaskState
from scenarios.tasks.engine import Status

SURE = 1.6448536269514722
"""Standard deviations from the pass mark that make a verdict: 95 %, one-sided."""

_WHOLE = {"breaches": "any", "tissue removed": "in all"}
"""Metrics that name only what happened, and the name of all of it together."""


class Evidence(NamedTuple):
    """What a session gives a rubric to read.

    session: name of the bundle. scenario: that was flown. span: seconds of the first
    and the last sample. tasks: their states, with times of the session, and
    removal_tasks the names of those about what is taken. operation: None where nobody
    operated. remarks: what limits trust in it. exercise: whose own pass mark is judged;
    None for none.
    """

    session: str
    scenario: str
    metrics: Sequence[Metric]
    span: Interval
    tasks: Sequence[TaskState] = ()
    removal_tasks: frozenset[str] = frozenset()
    operation: OperationFigures | None = None
    is_complete: bool = True
    remarks: tuple[str, ...] = ()
    exercise: Scenario | None = None


class _Value(NamedTuple):
    value: float | None
    unit: str
    role: str = ""
    reason: str = ""
    sigma: float | None = None
    floor: float | None = None
    intervals: tuple[Interval, ...] = ()
    is_noise: bool = False
    is_far: bool = False


def assess(
    rubric: Rubric, evidence: Evidence, population: Population | None = None
) -> Assessment:
    """Score a session.

    population: whose bands are shown beside the values; they change no points. The same
    arguments give the same bits.
    """
    remarks = list(evidence.remarks)
    if not evidence.is_complete:
        remarks.append("The recording ends in the middle.")
    if population is not None:
        problem = population.mismatch(evidence.scenario, rubric.settings)
        if problem:
            remarks.append(problem)
            population = None
    done = None
    if evidence.exercise is not None:
        done = done_share(evidence.exercise, evidence.tasks, evidence.metrics)
    parts = [_part(item, evidence, population, done) for item in rubric.items]
    too_little = _too_little(rubric, evidence)
    if too_little:
        parts = [_unjudged(part) for part in parts]
        remarks.insert(0, too_little)
    parts = _without_dominance(parts, remarks)
    fails = tuple(
        fail for rule in rubric.fails if (fail := _fail(rule, evidence)) is not None
    )
    remarks += [
        f"The rule {rule.title!r} cannot be checked: {found.reason}."
        for rule in rubric.fails
        if (found := _read(rule, evidence)).value is None and not found.is_far
    ]
    counting = [part for part in parts if part.counts]
    points = math.fsum(part.weight * part.points for part in counting)
    there = math.fsum(part.weight * part.most_points for part in counting)
    spread = math.hypot(*(part.weight * part.points_sigma for part in counting))
    flown, percent, sigma = None, None, 0.0
    needed = rubric.total_points * rubric.least_counted_percent / 100.0
    if there > 0.0 and there >= needed:
        most = min((fail.most_percent for fail in fails), default=100.0)
        flown = min(100.0 * points / there, most)
        share = 1.0 if done is None else done.share
        percent = flown * share
        # what a hard fail has cut off, noise does not bring back
        sigma = 100.0 * spread / there if flown < most or not fails else 0.0
        sigma *= share
    elif not too_little:
        remarks.append(
            f"Only {there:g} of {rubric.total_points:g} points could be scored; a "
            f"total needs {needed:g}."
        )
    mark = None
    if evidence.exercise is not None:
        mark = exercise_mark(
            evidence.exercise, evidence.tasks, evidence.metrics, percent
        )
    barred = ([too_little] if too_little else []) + [fail.why for fail in fails]
    if mark is not None and barred:
        missed = (*barred, *mark.missed)
        mark = ExerciseMark(Verdict.NOT_PASSED, missed, mark.kept)
    verdict = _verdict(percent, sigma, rubric.pass_percent)
    return Assessment(
        evidence.session,
        rubric.name,
        rubric.version,
        rubric.title,
        rubric.sha256(),
        tuple(parts),
        fails,
        points,
        there,
        rubric.total_points,
        percent,
        sigma,
        rubric.pass_percent,
        verdict if mark is None else mark.verdict,
        evidence.is_complete,
        tuple(remarks),
        mark,
        flown,
        done,
    )


def merged(intervals: Iterable[Interval]) -> tuple[Interval, ...]:
    """Return intervals in order, those that overlap or touch as one."""
    found: list[Interval] = []
    for begin, end in sorted(intervals):
        if found and begin <= found[-1][1]:
            found[-1] = found[-1][0], max(found[-1][1], end)
        else:
            found.append((begin, end))
    return tuple(found)


def _verdict(percent: float | None, sigma: float, mark: float) -> Verdict:
    if percent is None:
        return Verdict.NO_DATA
    if sigma > 0.0 and abs(percent - mark) < SURE * sigma:
        return Verdict.UNDECIDED
    return Verdict.PASSED if percent >= mark else Verdict.NOT_PASSED


def _too_little(rubric: Rubric, evidence: Evidence) -> str:
    """Return why a flight is too short to be judged; "" where it is not."""
    ways = [m for m in evidence.metrics if m.name == "path length"]
    if not ways or rubric.least_path_mm <= 0.0:
        return ""
    moved_mm = max(0.0 if m.is_noise else m.value or 0.0 for m in ways)
    if moved_mm >= rubric.least_path_mm:
        return ""
    told, least = value_text(moved_mm), value_text(rubric.least_path_mm)
    return (
        f"Too little was flown to be judged: a way of {told} mm, {least} mm are needed."
    )


def _unjudged(part: RubricPart) -> RubricPart:
    return msgspec.structs.replace(
        part,
        standing=Standing.NO_DATA,
        points=0.0,
        points_sigma=0.0,
        reason="too little was flown",
    )


def _withheld(item: Item, evidence: Evidence, done: DoneShare | None) -> str:
    """Return why an item gives no points whatever its value is; "" where it may."""
    if item.when_done and done is not None and not done.is_all:
        return f"only when all is done, and {done.done} of {done.asked} is"
    hurt = () if evidence.operation is None else evidence.operation.injuries
    if item.metric in NEARNESS and hurt:
        return f"{hurt[0].structure} was hurt"
    return ""


def _part(
    item: Item,
    evidence: Evidence,
    population: Population | None,
    done: DoneShare | None,
) -> RubricPart:
    found = _read(item, evidence)
    standing, points, spread = Standing.NO_DATA, 0.0, 0.0
    if found.is_far:
        standing, points = Standing.SCORED, item.bands[-1][1] * item.points / 100.0
    elif found.is_noise:
        standing = Standing.BELOW_NOISE
    elif found.value is not None:
        standing = Standing.SCORED
        points = item.points * percent_of(item.bands, found.value) / 100.0
        spread = percent_sigma(item.bands, found.value, found.sigma or 0.0)
    withheld = _withheld(item, evidence, done)
    if withheld and standing is Standing.SCORED:
        points = spread = 0.0
    bands: tuple[Band, ...] = ()
    if population is not None and item.metric:
        bands = population.bands(found.role, item.full_name, item.combine)
    is_removal = item.is_removal or item.task in evidence.removal_tasks
    return RubricPart(
        item.name,
        item.title,
        item.full_name,
        found.role,
        found.unit,
        standing,
        points,
        item.points,
        item.points * spread / 100.0,
        found.value,
        found.sigma,
        found.floor,
        item.bands,
        merged(found.intervals),
        found.reason,
        bands,
        is_removal,
        why=item.why,
        withheld=withheld if standing is Standing.SCORED else "",
    )


def _without_dominance(parts: list[RubricPart], remarks: list[str]) -> list[RubricPart]:
    """Hold points for removal back where too few others count beside them."""
    counting = [part for part in parts if part.counts]
    removal = math.fsum(part.most_points for part in counting if part.is_removal)
    others = math.fsum(part.most_points for part in counting) - removal
    most = MOST_REMOVAL_PERCENT / (100.0 - MOST_REMOVAL_PERCENT) * others
    if removal <= most * (1.0 + 1e-9):
        return parts
    remarks.append(
        f"Points for what was taken count {100 * most / removal:.0f} %: too few others "
        "could be scored beside them."
    )
    return [
        msgspec.structs.replace(part, weight=most / removal)
        if part.is_removal and part.counts
        else part
        for part in parts
    ]


def _fail(rule: FailRule, evidence: Evidence) -> HardFail | None:
    found = _read(rule, evidence)
    if found.value is None:
        return None
    unit = "" if found.unit in ("1", "count") else f" {found.unit}"
    for limit, is_broken, word in (
        (rule.above, rule.above is not None and found.value > rule.above, "above"),
        (rule.below, rule.below is not None and found.value < rule.below, "below"),
    ):
        if is_broken:
            told = value_text(found.value, unit=found.unit)
            why = f"{rule.full_name} is {told}, {word} {limit:g}{unit}"
            times = merged(found.intervals)
            return HardFail(rule.name, f"{rule.title}: {why}", rule.most_percent, times)
    return None


def _read(source: Source, evidence: Evidence) -> _Value:
    """Return the value that a rubric asks for, and the moments it came from."""
    if source.task:
        return _of_tasks(source, evidence)
    if source.figure:
        unit = FIGURES[source.figure]
        if evidence.operation is None:
            return _Value(None, unit, reason="not enough data: nobody operated")
        value = float(getattr(evidence.operation, source.figure))
        # summed up over the whole flight
        return _Value(value, unit, "patient", intervals=(evidence.span,))
    return _of_metrics(source, evidence)


def _of_tasks(source: Source, evidence: Evidence) -> _Value:
    states = evidence.tasks
    if source.task != ANY_TASK:
        states = [state for state in states if state.name == source.task]
    if not states:
        names = [state.name for state in evidence.tasks]
        near = difflib.get_close_matches(source.task, names, 1)
        hint = f"; did you mean {near[0]!r}?" if near else ""
        what = "tasks" if source.task == ANY_TASK else f"task {source.task!r}"
        return _Value(
            None, "1", reason=f"not enough data: the exercise has no {what}{hint}"
        )
    reached = [0.0 if s.status is Status.FAILED else s.progress for s in states]
    spans = tuple(
        (s.opened_s, evidence.span[1] if s.ended_s is None else s.ended_s)
        for s in states
        if s.opened_s is not None
    )
    why = "; ".join(f"{s.name}: {s.why}" for s in states if s.why)
    value = math.fsum(reached) / len(reached)
    return _Value(value, "1", reason=why, intervals=spans)


def _of_metrics(source: Source, evidence: Evidence) -> _Value:
    of = source.of or _WHOLE.get(source.metric, "")
    role = source.role
    rows = [
        m
        for m in evidence.metrics
        if (not role or m.role == role)
        and (m.name == source.metric or m.name.startswith(f"{source.metric}: "))
    ]
    if not rows:
        reason = f"not enough data: {source.metric} was not measured"
        return _Value(None, "", role, reason)
    first = rows[0]
    role = first.role
    if of:
        named = [m for m in rows if m.name == f"{source.metric}: {of}"]
        if not named and source.metric in _WHOLE and first.value is not None:
            return _Value(0.0, first.unit, role, "it did not happen")
        if not named:
            known = [m.name.partition(": ")[2] for m in rows]
            near = difflib.get_close_matches(of, known, 1)
            hint = f"; did you mean {near[0]!r}?" if near else ""
            reason = first.reason or f"not enough data: {of!r} was not measured{hint}"
            return _Value(None, first.unit, role, reason)
        rows = named
    known_rows = [m for m in rows if m.value is not None]
    if not known_rows:
        is_far = all(m.reason.startswith(FAR) for m in rows)
        return _Value(None, first.unit, role, first.reason, is_far=is_far)
    return _combined(known_rows, source.combine)


def _combined(rows: list[Metric], combine: Combine) -> _Value:
    """Return one value of several; each has one."""
    first = rows[0]
    if combine is not Combine.SUM or len(rows) == 1:
        pick = min if combine is Combine.SMALLEST else max
        one = pick(rows, key=lambda m: m.value or 0.0)
        what = one.name.partition(": ")[2] if len(rows) > 1 else ""
        return _Value(
            one.value,
            one.unit,
            one.role,
            what or one.reason,
            one.sigma,
            one.floor,
            one.intervals,
            one.is_noise,
        )
    sigmas = [m.sigma for m in rows if m.sigma is not None]
    return _Value(
        math.fsum(m.value or 0.0 for m in rows),
        first.unit,
        first.role,
        "",
        math.hypot(*sigmas) if len(sigmas) == len(rows) else None,
        None,
        tuple(i for m in rows for i in m.intervals),
        all(m.is_noise for m in rows),
    )
