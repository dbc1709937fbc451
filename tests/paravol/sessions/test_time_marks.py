"""Marks on a time line: what is recorded, what is measured, and jumping between."""

from dataclasses import replace

import msgspec
import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from paravol.debrief.events import Event
from paravol.debrief.events import Kind as EventKind
from paravol.sessions.time_marks import (
    MarkKind,
    TimeMark,
    measured_marks,
    next_mark,
    note_marks,
    recorded_marks,
)
from scenarios import Sample, tip_frame
from scenarios.bundle import EventRecord, Note, Record, SampleRecord
from scenarios.instrument_state import NO_TOOL, InstrumentState

TIMES = st.lists(st.floats(0.0, 100.0), max_size=12)


def sample(time_s: float, tool: str) -> SampleRecord:
    zero = np.zeros(3)
    pose = tip_frame(zero, np.array([0.0, 1.0, 0.0]))
    made = Sample(time_s, pose, 0.0, zero, zero, 0, InstrumentState(tool))
    return SampleRecord.of(made)


def test_a_recording_tells_its_events_and_each_change_of_the_tool() -> None:
    records: list[Record] = [
        sample(0.0, NO_TOOL),
        sample(1.0, "curette"),
        EventRecord(1.5, "injury", "orbit, left"),
        sample(2.0, "curette"),
        sample(3.0, NO_TOOL),
        EventRecord(3.5, "unheard of", "left out"),
        msgspec.structs.replace(sample(4.0, NO_TOOL), scope_deg=30.0),
    ]
    found = [(m.kind, m.time_s, m.text) for m in recorded_marks(records)]
    assert found == [
        (MarkKind.TOOL, 1.0, "Tool: curette"),
        (MarkKind.INJURY, 1.5, "Injury: orbit, left"),
        (MarkKind.TOOL, 3.0, "Tool put away"),
        (MarkKind.TOOL, 4.0, "Scope: 30°"),
    ]


def test_what_is_measured_replaces_its_kinds_and_no_others() -> None:
    recorded = [
        TimeMark.at(MarkKind.TOOL, 4.0, "Tool: curette"),
        TimeMark.at(MarkKind.INJURY, 2.0, "as recorded"),
    ]
    near = Event(EventKind.HAZARD, 1.0, 3.0, 2.5, "Scope near", "1 mm")
    events = [near, replace(near, is_told=False), replace(near, kind=EventKind.CUT)]
    tool, *others = sorted(
        measured_marks(recorded, events), key=lambda m: m.kind != "tools"
    )
    assert tool == recorded[0]
    assert others == [TimeMark(MarkKind.NEAR, 2.5, 1.0, 3.0, "Scope near: 1 mm")]


@given(TIMES, st.floats(0.0, 100.0))
def test_jumping_on_visits_every_mark_once(times: list[float], begin_s: float) -> None:
    """Forwards from a time come all marks after it, each later than the one before."""
    marks = note_marks([Note(t, "x") for t in times])
    for step in (1, -1):
        at_s, seen = begin_s, []
        while (mark := next_mark(marks, at_s, step, 0.0)) is not None:
            assert (mark.time_s - at_s) * step > 0.0
            at_s = mark.time_s
            seen.append(at_s)
        expected = sorted({t for t in times if (t - begin_s) * step > 0.0})
        assert seen == expected[::step]
