"""What to practise next, by plain rules from the lowest parts of a session."""

from collections.abc import Sequence
from dataclasses import dataclass

from paravol.debrief.events import Event, Kind
from paravol.debrief.findings import Findings
from scenarios import Scenario, Score
from scenarios.metrics.metric import SCOPE
from scenarios.metrics.value_text import value_text
from scenarios.rubrics import Assessment, RubricPart, Verdict
from scenarios.tasks.engine import Status

MOST = 4
"""Things to practise that are told; more would not be practised."""

LOW_SHARE = 0.7
"""Parts of the score that gave less than this of their points can be practised."""

CONTACT_SHARE = 0.1
"""Of the time: the scope that touches for longer is steered too close."""

HURT = "Stay out of what must not be hurt"

LONGER = 1.25
"""So much above what it is compared with, a figure is worth practising."""

_DRILLS = {
    "hazard": "Fly the way to the place again without cutting. Stop before the margin, "
    "say the distance aloud, draw back, go on.",
    "contact": "Fly in and out slowly and keep the scope in the middle of the passage; "
    "stop at each narrow place and look before going on.",
    "smooth": "Practise following a target with a still horizon: begin each movement "
    "slowly, end it without correcting.",
    "view": "Keep the target in the middle of the picture and the horizon level while "
    "the other hand moves.",
    "removal": "Plan the cut on the scan first; take small bites from the free edge "
    "and look again after each.",
    "path": "Fly the recorded path beside your own in `paravol replay`, then fly it "
    "without stopping to search.",
}

_LONG = "task time", "path length", "idle share"

_WORDS = (
    (("margin", "near miss", "hazard", "breach", "smallest distance"), "hazard"),
    (("contact", "touch", "force", "lens", "broken"), "contact"),
    (("LDLJ", "SPARC", "jerk", "steadiness", "smooth", "peaks"), "smooth"),
    (("horizon", "centr", "view", "working distance", "attended"), "view"),
    (("removed", "wanted", "protected", "tissue"), "removal"),
    (("path", "economy", "idle", "time", "deviation", "speed"), "path"),
)


@dataclass(frozen=True, slots=True)
class Advice:
    """One thing to practise: what, why, how; anchor of the event for it."""

    title: str
    why: str
    how: str
    anchor: str = ""


GO_ON = Advice("Go on", "Nothing stands out.", "Fly the next exercise.")
ONCE_MORE = Advice("Once more", "Nothing stands out.", "Fly it to its end.")


def advice(
    findings: Findings, events: Sequence[Event], assessment: Assessment
) -> list[Advice]:
    """Return what to practise, the most urgent first, `MOST` at most.

    In this order: injuries, tasks that failed, hazards, the lowest parts of the score,
    contact, what was longer than in what it is compared with.
    """
    score = findings.score
    found = [*_hurt(score, events), *_undone(score, findings.scenario, events)]
    found += [*_near(events), *_low_parts(assessment)]
    found += [*_touching(score, events), *_against(findings)]
    return _unlike(found, assessment)


def advice_on(score: Score, scenario: Scenario, assessment: Assessment) -> list[Advice]:
    """Return what to practise by a session's score alone, without its events."""
    found = [*_hurt(score), *_undone(score, scenario), *_low_parts(assessment)]
    return _unlike([*found, *_touching(score)], assessment)


def _unlike(found: Sequence[Advice], assessment: Assessment) -> list[Advice]:
    """Return the first of each kind, `MOST` at most, or what follows from none."""
    if not found:
        is_passed = assessment.verdict is Verdict.PASSED
        found = [GO_ON if is_passed else ONCE_MORE]
    unlike: dict[str, Advice] = {}
    for each in found:
        unlike.setdefault(each.how, each)
    return list(unlike.values())[:MOST]


def _hurt(score: Score, events: Sequence[Event] = ()) -> list[Advice]:
    hurt = [] if score.operation is None else score.operation.injuries
    if not hurt:
        return []
    worst = max(hurt, key=lambda injury: injury.depth_mm)
    told = [event for event in events if event.kind is Kind.INJURY]
    gravest = max(told, key=lambda event: event.gravity, default=None)
    why = (
        f"{len(hurt)} in this session; the deepest: {worst.structure}, "
        f"{worst.depth_mm:.1f} mm at {worst.time_s:.1f} s."
    )
    anchor = "" if gravest is None else gravest.anchor
    return [Advice(HURT, why, _DRILLS["hazard"], anchor)]


def _undone(
    score: Score, scenario: Scenario, events: Sequence[Event] = ()
) -> list[Advice]:
    names = {task.name: task for task in scenario.tasks}
    bad = [s for s in score.tasks if s.status is not Status.DONE]
    if not bad:
        return []
    first = bad[0]
    task = names.get(first.name)
    title = first.name if task is None else task.title
    hint = "" if task is None else task.hint
    anchors = [e.anchor for e in events if e.kind is Kind.TASK and title in e.title]
    why = f"{first.why or f'It reached {first.progress:.0%}'}."
    how = hint or "Do this task alone until it is done."
    return [Advice(f"The task: {title}", why, how, anchors[0] if anchors else "")]


def _near(events: Sequence[Event]) -> list[Advice]:
    near = [e for e in events if e.kind is Kind.HAZARD]
    if not near:
        return []
    worst = max(near, key=lambda e: e.gravity)
    why = f"{len(near)} times inside a margin; the nearest: {worst.title}."
    return [Advice("Keep the margin to hazards", why, _DRILLS["hazard"], worst.anchor)]


def _low_parts(assessment: Assessment) -> list[Advice]:
    low = [
        part
        for part in assessment.parts
        if part.counts
        and not part.withheld
        and part.points < LOW_SHARE * part.most_points
    ]
    low.sort(key=lambda part: part.points - part.most_points)
    return [
        Advice(
            part.title,
            f"{part.points:.1f} of {part.most_points:g} points: {part.source} was "
            f"{amount(part)}.",
            drill_for(part.source),
        )
        for part in low
    ]


def amount(part: RubricPart) -> str:
    """Return a part's value with 1 sigma and its unit, or why there is none."""
    if part.value is None:
        return part.reason or "not known"
    return value_text(part.value, part.sigma, part.unit)


def drill_for(name: str) -> str:
    """Return the exercise for a metric, by the words in its name."""
    for words, drill in _WORDS:
        if any(word in name for word in words):
            return _DRILLS[drill]
    return _DRILLS["path"]


def _touching(score: Score, events: Sequence[Event] = ()) -> list[Advice]:
    if score.contact_s <= CONTACT_SHARE * score.duration_s:
        return []
    touching = [e for e in events if e.kind is Kind.CONTACT and e.is_told]
    worst = max(touching, key=lambda e: e.gravity, default=None)
    why = (
        f"The scope touched for {score.contact_s:.1f} of {score.duration_s:.1f} s, at "
        f"the deepest {score.worst_depth_mm:.1f} mm ({score.worst_structure})."
    )
    anchor = "" if worst is None else worst.anchor
    return [Advice("Steer in the middle", why, _DRILLS["contact"], anchor)]


def _against(findings: Findings) -> list[Advice]:
    """Return what took more time or way than in what it is compared with."""
    if findings.compared is None:
        return []
    found = []
    for own, other in findings.compared.rows:
        if own.name not in _LONG or own.role != SCOPE:
            continue
        if own.value is None or not other.value or own.value <= LONGER * other.value:
            continue
        why = (
            f"{own.name}: {own.value:.1f} {own.unit}, in {findings.compared.title} "
            f"{other.value:.1f} {other.unit}."
        )
        found.append(Advice("Find the way without searching", why, _DRILLS["path"]))
    return found
