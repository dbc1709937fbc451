"""What happened in a session, in order: tasks, cuts, injuries, nearness, contacts."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from paravol.debrief.findings import Findings
from scenarios.bundle import EventRecord
from scenarios.metrics.measured import Taken
from scenarios.tasks.engine import Status

APART_S = 0.5
"""Events of one kind that are nearer than this are one."""

MOST_OF_A_KIND = 15
"""Of cuts, contacts and approaches, the gravest that are told one by one."""


class Kind(StrEnum):
    """Name what happened; also the lane of the timeline."""

    TASK = "tasks"
    INJURY = "injuries"
    BREAK = "broken bone"
    HAZARD = "near hazards"
    CUT = "cuts"
    CONTACT = "contacts"
    FROZEN = "frozen"
    SCOPE = "scopes"
    DEVICE = "device"
    AID = "aids"
    SNAPSHOT = "snapshots"
    MOMENT = "moments"


URGENCY = tuple(Kind)
"""Kinds by what deserves a picture most."""


@dataclass(frozen=True, slots=True)
class Event:
    """One thing that happened.

    begin_s, end_s: of the session. shown_s: the moment to look at. title, detail: in
    words. gravity: larger is graver, among its kind. is_told: it has an entry of its
    own; else a mark only. number: of the entry, in order of time.
    """

    kind: Kind
    begin_s: float
    end_s: float
    shown_s: float
    title: str
    detail: str = ""
    gravity: float = 0.0
    is_told: bool = True
    number: int = 0

    @property
    def anchor(self) -> str:
        """Return the name that links lead to."""
        return f"event-{self.number}"


def events_of(findings: Findings) -> list[Event]:
    """Return all that happened, in order of time, the told ones numbered from 1."""
    found = [
        *_tasks(findings),
        *_hurts(findings),
        *_gravest(_approaches(findings)),
        *_gravest(_cuts(findings.metrics.measured.edits or ())),
        *_gravest(_contacts(findings)),
        *_noted(findings),
    ]
    found.sort(key=lambda event: (event.shown_s, URGENCY.index(event.kind)))
    numbers = iter(range(1, len(found) + 1))
    return [replace(e, number=next(numbers)) if e.is_told else e for e in found]


def worth_a_picture(events: Sequence[Event], most: int) -> list[Event]:
    """Return the told events that get a picture: each kind's gravest by turns.

    Whatever is most urgent comes first in every turn.
    """
    queues = [
        sorted(
            (e for e in events if e.kind is kind and e.is_told),
            key=lambda e: (-e.gravity, e.shown_s),
        )
        for kind in URGENCY
        if kind not in (Kind.FROZEN, Kind.DEVICE, Kind.AID)
    ]
    chosen: list[Event] = []
    while any(queues) and len(chosen) < most:
        for queue in queues:
            if queue and len(chosen) < most:
                chosen.append(queue.pop(0))
    return chosen


def _gravest(events: list[Event]) -> list[Event]:
    """Let the gravest be told, the others be marks only."""
    order = sorted(events, key=lambda event: (-event.gravity, event.begin_s))
    told = set(map(id, order[:MOST_OF_A_KIND]))
    return [e if id(e) in told else replace(e, is_told=False) for e in events]


def _tasks(findings: Findings) -> list[Event]:
    followed, score = findings.followed, findings.score
    titles = {task.name: task.title for task in findings.scenario.tasks}
    found = []
    for state in score.tasks:
        if state.opened_s is None:
            continue
        begin_s = followed.session_time(state.opened_s)
        end_s = findings.end_s
        if state.ended_s is not None:
            end_s = followed.session_time(state.ended_s)
        is_open = state.status is Status.OPEN
        word = "not finished" if is_open else str(state.status)
        title = f"Task {word}: {titles.get(state.name, state.name)}"
        gravity = {Status.FAILED: 2.0, Status.OPEN: 1.0}.get(state.status, 0.0)
        found.append(Event(Kind.TASK, begin_s, end_s, end_s, title, state.why, gravity))
    return found


def _at(
    kind: Kind, time_s: float, title: str, detail: str = "", gravity: float = 0.0
) -> Event:
    """Return an event that is over at once."""
    return Event(kind, time_s, time_s, time_s, title, detail, gravity)


def _hurts(findings: Findings) -> list[Event]:
    """Return injuries and broken walls."""
    operation = findings.score.operation
    if operation is None:
        return []
    injuries = [
        _at(
            Kind.INJURY,
            injury.time_s,
            f"Injury: {injury.structure}, {injury.side}",
            f"{injury.depth_mm:.1f} mm deep by the {injury.by}"
            + (f", through the {injury.wall}" if injury.wall else ""),
            injury.depth_mm,
        )
        for injury in operation.injuries
    ]
    return injuries + [
        _at(Kind.BREAK, broken.time_s, f"Broken: {broken}", gravity=broken.force_n)
        for broken in operation.breaks
    ]


def _lasting(
    time_s: NDArray[np.float64], gap_mm: NDArray[np.float64], margin_mm: float
) -> Iterator[tuple[int, float, float]]:
    """Yield of each stretch below a margin the place of the least gap and its ends."""
    gap_mm = np.nan_to_num(gap_mm, nan=np.inf)
    for begin, end in spans(time_s, gap_mm < margin_mm):
        place = begin + int(np.argmin(gap_mm[begin : end + 1]))
        yield place, float(time_s[begin]), float(time_s[end])


def _approaches(findings: Findings) -> list[Event]:
    measured = findings.metrics.measured
    found = []
    for role, gaps in (("scope", measured.hazards), ("tool", measured.tool_hazards)):
        if gaps is None:
            continue
        for name, gap_mm in gaps.gap_mm.items():
            margin_mm = measured.settings.margin_of(name)
            for place, begin_s, end_s in _lasting(gaps.time_s, gap_mm, margin_mm):
                nearest_mm = float(gap_mm[place])
                title = f"{role} {nearest_mm:.1f} mm from the {name}".capitalize()
                for_s = f"nearer than {margin_mm:g} mm for {end_s - begin_s:.1f} s"
                shown_s = float(gaps.time_s[place])
                gravity = margin_mm - nearest_mm
                found.append(
                    Event(Kind.HAZARD, begin_s, end_s, shown_s, title, for_s, gravity)
                )
    return found


def _cuts(edits: Sequence[Taken]) -> list[Event]:
    groups: list[list[Taken]] = []
    for edit in edits:
        last = groups[-1][-1] if groups else None
        if last and edit.tool == last.tool and edit.time_s <= last.time_s + APART_S:
            groups[-1].append(edit)
        else:
            groups.append([edit])
    found = []
    for group in groups:
        taken: dict[str, float] = {}
        for edit in group:
            for tissue, mm3 in edit.taken_mm3.items():
                taken[tissue] = taken.get(tissue, 0.0) + mm3
        whole = sum(taken.values())
        most = sorted(taken.items(), key=lambda item: (-item[1], item[0]))[:3]
        told = ", ".join(f"{name} {mm3:.1f}" for name, mm3 in most)
        begin_s, end_s = group[0].time_s, group[-1].time_s
        title = f"{whole:.0f} mm3 taken with the {group[0].tool}"
        found.append(Event(Kind.CUT, begin_s, end_s, end_s, title, told, whole))
    return found


def _contacts(findings: Findings) -> list[Event]:
    contacts = findings.metrics.measured.contacts
    if contacts is None:
        return []
    found = []
    for place, begin_s, end_s in _lasting(contacts.time_s, contacts.gap_mm, 0.0):
        depth_mm = float(-contacts.gap_mm[place])
        code = int(contacts.touched[place])
        title = f"Scope touches {contacts.names[code] if code >= 0 else 'tissue'}"
        detail = f"{depth_mm:.2f} mm deep, {end_s - begin_s:.1f} s"
        shown_s = float(contacts.time_s[place])
        found.append(
            Event(Kind.CONTACT, begin_s, end_s, shown_s, title, detail, depth_mm)
        )
    return found


def _noted(findings: Findings) -> list[Event]:
    """Return what was written down in flight, and the moments that are named."""
    kinds = {"device": Kind.DEVICE, "aid": Kind.AID, "snapshot": Kind.SNAPSHOT}
    frozen = [
        Event(Kind.FROZEN, a, b, a, "Trainer frozen", f"{b - a:.1f} s, not scored")
        for a, b in findings.followed.frozen
    ]
    scopes = [
        _at(Kind.SCOPE, at_s, f"Scope of {angle_deg:g}° put in")
        for at_s, angle_deg in findings.metrics.measured.scope_changes
    ]
    recorded = [
        _at(
            kinds[record.kind],
            min(record.time_s, findings.end_s),
            record.kind.capitalize(),
            record.text,
        )
        for record in findings.recording.records
        if isinstance(record, EventRecord) and record.kind in kinds
    ]
    moments = [
        _at(Kind.MOMENT, moment.time_s, moment.name.capitalize())
        for moment in findings.scenario.moments
        if findings.begin_s <= moment.time_s <= findings.end_s
    ]
    return [*frozen, *scopes, *recorded, *moments]


def spans(
    time_s: NDArray[np.float64], is_so: NDArray[np.bool_]
) -> list[tuple[int, int]]:
    """Return first and last places of stretches; those near in time join."""
    places = np.flatnonzero(is_so)
    if not len(places):
        return []
    breaks = np.flatnonzero(np.diff(time_s[places]) > APART_S)
    firsts = np.concatenate([places[:1], places[breaks + 1]])
    lasts = np.concatenate([places[breaks], places[-1:]])
    return list(zip(firsts.tolist(), lasts.tolist(), strict=True))
