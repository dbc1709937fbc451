"""Events are told by gravity and in order; pictures go round the kinds."""

from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from paravol.debrief.charts import timeline
from paravol.debrief.events import (
    APART_S,
    URGENCY,
    Event,
    Kind,
    events_of,
    spans,
    worth_a_picture,
)
from scenarios import Scenario, Score
from scenarios.scoring import BreakFigure, OperationFigures

EVENTS = st.lists(
    st.builds(
        Event,
        st.sampled_from(URGENCY),
        st.just(0.0),
        st.just(1.0),
        st.floats(0.0, 60.0),
        st.just("an event"),
        gravity=st.floats(0.0, 5.0),
        is_told=st.booleans(),
    ),
    max_size=20,
)


def test_every_kind_of_event_is_drawn() -> None:
    """The way is an aid: who had it shown got no debrief."""
    findings: Any = SimpleNamespace(
        begin_s=0.0, end_s=60.0, followed=SimpleNamespace(blood=[])
    )
    events = [
        Event(kind, n, n + 0.5, n, f"something {n}", number=n, is_told=told)
        for n, kind in enumerate(Kind)
        for told in (True, False)
    ]
    drawn = timeline(findings, events)
    for n, kind in enumerate(Kind):
        assert str(kind) in drawn
        assert drawn.count(f"something {n}.") == 2


@given(st.lists(st.booleans(), min_size=1, max_size=60), st.floats(0.05, 2.0))
def test_spans_hold_all_that_is_so_and_lie_apart(
    so: list[bool], every_s: float
) -> None:
    times = np.arange(len(so), dtype=np.float64) * every_s
    is_so = np.array(so)
    found = spans(times, is_so)
    covered = np.zeros(len(so), bool)
    for first, last in found:
        assert is_so[first]
        assert is_so[last]
        covered[first : last + 1] = True
    assert np.all(covered[is_so])
    for (_, last), (first, _) in pairwise(found):
        assert times[first] - times[last] > APART_S


@given(EVENTS, st.integers(0, 12))
def test_pictures_go_to_told_events_of_every_kind(
    events: list[Event], most: int
) -> None:
    chosen = worth_a_picture(events, most)
    assert len(chosen) <= most
    assert all(event.is_told for event in chosen)
    shown = [
        e
        for e in events
        if e.is_told and e.kind not in (Kind.FROZEN, Kind.DEVICE, Kind.AID)
    ]
    assert len(chosen) == min(most, len(shown))
    if most >= len(URGENCY):
        assert {e.kind for e in chosen} == {e.kind for e in shown}
    if chosen:
        urgent = min(URGENCY.index(e.kind) for e in shown)
        assert URGENCY.index(chosen[0].kind) == urgent


def test_bone_that_broke_is_among_the_events() -> None:
    """A wall that gave in at 24 N and one at 91 N were in no list."""
    breaks = [
        BreakFigure(1.5, "thin bone", 24.0, "curette"),
        BreakFigure(2.5, "", 91.0, "endoscope"),
    ]
    score = Score(9.0, 0.0, 1.0, 0, {}, operation=OperationFigures(breaks=breaks))
    measured = SimpleNamespace(
        hazards=None, tool_hazards=None, edits=None, contacts=None, scope_changes=()
    )
    findings: Any = SimpleNamespace(
        score=score,
        scenario=Scenario("s", "S"),
        metrics=SimpleNamespace(measured=measured),
        followed=SimpleNamespace(frozen=()),
        recording=SimpleNamespace(records=()),
        begin_s=0.0,
        end_s=9.0,
    )
    found = [(e.kind, e.shown_s, e.title, e.number) for e in events_of(findings)]
    assert found == [
        (Kind.BREAK, 1.5, "Broken: thin bone, at 24.0 N by the curette", 1),
        (Kind.BREAK, 2.5, "Broken: bone, at 91.0 N by the endoscope", 2),
    ]
