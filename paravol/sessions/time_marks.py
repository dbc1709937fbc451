"""What a time line shows of a session: marks of what happened, with words."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import StrEnum

from paravol.debrief.events import Event
from paravol.debrief.events import Kind as EventKind
from scenarios.bundle import EventRecord, Note, Record, SampleRecord
from scenarios.instrument_state import NO_TOOL


class MarkKind(StrEnum):
    """Name what a mark is of; also the lane of the time line, from the top."""

    TASK = "tasks"
    INJURY = "injuries"
    NEAR = "near misses"
    TOOL = "tools"
    MOMENT = "moments"
    NOTE = "notes"


@dataclass(frozen=True, slots=True)
class TimeMark:
    """Mark a moment: time_s to jump to, begin_s to end_s to draw, words to read."""

    kind: MarkKind
    time_s: float
    begin_s: float
    end_s: float
    text: str

    @classmethod
    def at(cls, kind: MarkKind, time_s: float, text: str) -> "TimeMark":
        """Mark one moment."""
        return cls(kind, time_s, time_s, time_s, text)


_RECORDED = {
    "task": MarkKind.TASK,
    "injury": MarkKind.INJURY,
    "break": MarkKind.INJURY,
    "snapshot": MarkKind.MOMENT,
    "moment": MarkKind.MOMENT,
    "device": MarkKind.TOOL,
}
"""Kinds of a recording's events; others are not shown."""

_FOUND = {
    EventKind.TASK: MarkKind.TASK,
    EventKind.INJURY: MarkKind.INJURY,
    EventKind.BREAK: MarkKind.INJURY,
    EventKind.HAZARD: MarkKind.NEAR,
    EventKind.CONTACT: MarkKind.NEAR,
    EventKind.SNAPSHOT: MarkKind.MOMENT,
    EventKind.MOMENT: MarkKind.MOMENT,
}
"""Kinds of a debrief's events; others are not shown."""

MEASURED = frozenset({MarkKind.TASK, MarkKind.INJURY, MarkKind.NEAR, MarkKind.MOMENT})
"""Kinds that a measured session tells more of than its recording does."""


def recorded_marks(records: Iterable[Record]) -> list[TimeMark]:
    """Return what the recording itself says, in order of time: no head is needed."""
    marks: list[TimeMark] = []
    before: SampleRecord | None = None
    for record in records:
        if isinstance(record, SampleRecord):
            if before is not None:
                marks += [
                    TimeMark.at(MarkKind.TOOL, record.time_s, text)
                    for text in _exchanged(before, record)
                ]
            before = record
        elif isinstance(record, EventRecord) and record.kind in _RECORDED:
            kind = _RECORDED[record.kind]
            text = f"{record.kind.capitalize()}: {record.text}"
            marks.append(TimeMark.at(kind, max(record.time_s, 0.0), text))
    return sorted(marks, key=lambda mark: mark.time_s)


def _exchanged(before: SampleRecord, record: SampleRecord) -> list[str]:
    """Say which tool or scope was exchanged between two samples."""
    texts = []
    name = record.instrument.name
    if name != before.instrument.name:
        texts.append("Tool put away" if name == NO_TOOL else f"Tool: {name}")
    angle = record.scope_deg
    if angle != before.scope_deg:
        texts.append("Scope: the first" if angle is None else f"Scope: {angle:g}°")
    return texts


def measured_marks(
    recorded: Sequence[TimeMark], events: Sequence[Event]
) -> list[TimeMark]:
    """Return the marks of a session that was measured, in order of time.

    recorded: of the recording; what was measured takes the place of its kinds. events:
    of the debrief.
    """
    marks = [mark for mark in recorded if mark.kind not in MEASURED]
    for event in events:
        kind = _FOUND.get(event.kind)
        if kind is None or not event.is_told:
            continue
        text = f"{event.title}: {event.detail}" if event.detail else event.title
        marks.append(TimeMark(kind, event.shown_s, event.begin_s, event.end_s, text))
    return sorted(marks, key=lambda mark: mark.time_s)


def note_marks(notes: Sequence[Note]) -> list[TimeMark]:
    """Return the marks of a teacher's notes."""
    return [TimeMark.at(MarkKind.NOTE, note.at_s, note.text) for note in notes]


def next_mark(
    marks: Sequence[TimeMark], time_s: float, step: int, apart_s: float = 0.05
) -> TimeMark | None:
    """Return the mark after a time (step 1) or before it (-1); None for none.

    apart_s: what is nearer is where one stands already.
    """
    if step > 0:
        later = [mark for mark in marks if mark.time_s > time_s + apart_s]
        return min(later, key=lambda mark: mark.time_s, default=None)
    earlier = [mark for mark in marks if mark.time_s < time_s - apart_s]
    return max(earlier, key=lambda mark: mark.time_s, default=None)
