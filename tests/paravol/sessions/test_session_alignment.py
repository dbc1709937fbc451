"""The time map between two sessions: monotone, symmetric, exact where it is tied."""

from pathlib import Path

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from paravol.sessions.session_alignment import (
    NEAR_MM,
    Mark,
    TimeMap,
    align,
    session_marks,
)
from scenarios import Sample, tip_frame
from scenarios.bundle import EventRecord, Recording, SampleRecord
from tests.scenarios.session_info import INFO

NAMES = "abcdefgh"
MARKS = st.dictionaries(
    st.sampled_from(NAMES),
    st.builds(Mark, st.integers(-5, 105).map(float), st.integers(0, 9).map(float)),
)
SPAN = (0.0, 100.0)


@given(here=MARKS, there=MARKS)
def test_exchanged_sessions_give_the_inverse_map(
    here: dict[str, Mark], there: dict[str, Mark]
) -> None:
    forth, back = align(here, there, SPAN, SPAN), align(there, here, SPAN, SPAN)
    assert forth.names == back.names
    assert np.array_equal(forth.here_s, back.there_s)
    assert np.array_equal(forth.there_s, back.here_s)
    for time_s in np.linspace(*SPAN, 23):
        assert back.at(forth.at(time_s)) == pytest.approx(time_s, abs=1e-9)


@given(here=MARKS, there=MARKS)
def test_the_map_rises_and_ties_what_it_names(
    here: dict[str, Mark], there: dict[str, Mark]
) -> None:
    found = align(here, there, SPAN, (0.0, 120.0))
    assert (np.diff(found.here_s) > 0).all()
    assert (np.diff(found.there_s) > 0).all()
    assert found.at(-5.0) == 0.0
    assert found.at(500.0) == 120.0
    for name in found.names:
        assert found.at(here[name].time_s) == pytest.approx(there[name].time_s)
    longest = max((len(c) for c in _chains(here, there, SPAN, (0.0, 120.0))), default=0)
    assert len(found.names) == longest


def _chains(
    here: dict[str, Mark],
    there: dict[str, Mark],
    here_s: tuple[float, float],
    there_s: tuple[float, float],
) -> list[list[str]]:
    """All chains in one order in both, the slow way."""
    chains: list[list[str]] = [[]]
    shared = [
        n
        for n in here.keys() & there.keys()
        if here_s[0] < here[n].time_s < here_s[1]
        and there_s[0] < there[n].time_s < there_s[1]
    ]
    for name in sorted(shared, key=lambda n: here[n].time_s):
        chains += [
            [*chain, name]
            for chain in chains
            if not chain
            or (
                here[chain[-1]].time_s < here[name].time_s
                and there[chain[-1]].time_s < there[name].time_s
            )
        ]
    return chains


@given(marks=MARKS)
def test_a_session_beside_itself_is_the_same_moment(marks: dict[str, Mark]) -> None:
    found = align(marks, marks, SPAN, SPAN)
    for time_s in np.linspace(*SPAN, 29):
        assert found.at(time_s) == pytest.approx(time_s, abs=1e-9)


def recording(speed: float, *, order: str = "") -> Recording:
    """Fly along x at a speed, mm/s; the device lies 5 mm off the patient."""
    matrix = np.eye(4)
    matrix[0, 3] = 5.0
    info = msgspec.structs.replace(INFO, world_from_device=matrix.ravel().tolist())
    records: list[SampleRecord | EventRecord] = []
    for i in range(200):
        tip = np.array([speed * i * 0.1 - 5.0, 0.0, 0.0])
        pose = tip_frame(tip, np.array([1.0, 0.0, 0.0]))
        records.append(SampleRecord.of(Sample(i * 0.1, pose, 0.0, tip, tip + 1.0, 0)))
    records.append(EventRecord(7.0, "task", f"look: {order or 'done'}"))
    return Recording(info, list(records), True, (), {})


def test_landmarks_and_tasks_are_found_in_the_patient() -> None:
    places = {
        "near": np.array([10.0, 3.0, 0.0]),
        "late": np.array([15.0, 0.0, 0.0]),
        "far": np.array([12.0, NEAR_MM + 1.0, 0.0]),
        "at the beginning": np.array([0.5, 0.0, 0.0]),
        "still ahead": np.array([41.0, 0.0, 0.0]),
    }
    slow, fast = (session_marks(recording(v), places) for v in (1.0, 2.0))
    assert slow == {
        "near": Mark(10.0, 3.0),
        "late": Mark(15.0, 0.0),
        "task look: done": Mark(7.0, 0.0),
    }
    assert fast["near"] == Mark(5.0, 3.0)
    found: TimeMap = align(slow, fast, (0.0, 19.9), (0.0, 19.9))
    # done before "near" in one session and after it in the other: the exact one stays
    assert found.names == ("task look: done", "late")
    assert found.at(11.0) == pytest.approx(7.25)


def test_an_empty_recording_has_reached_nothing(tmp_path: Path) -> None:
    places = {"a": np.zeros(3)}
    assert session_marks(Recording(INFO, [], False, (), {}), places) == {}
