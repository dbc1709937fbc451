"""Tasks open in their order, and the same samples give the same events."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scenarios.tasks import Status, TaskEngine, TaskEvent
from scenarios.tasks import task as tasks
from scenarios.tasks.engine import EngineState
from system import UserError
from tests.scenarios.tasks.test_rules import PLACES, at

LADDER: tuple[tasks.Task, ...] = (
    tasks.Reach(name="in", title="Go in", place="ostium", radius_mm=2.0, hold_s=0.1),
    tasks.Reach(
        name="on", title="Go on", place="bulla", radius_mm=2.0, after=("in",), hold_s=0
    ),
    tasks.KeepAway(
        name="safe", title="Keep off", hazards=("orbit",), margin_mm=4, most_dose_s=0.2
    ),
    tasks.Hold(
        name="still",
        title="Hold",
        place="bulla",
        radius_mm=4,
        still_mm=1,
        hold_s=0.1,
        is_optional=True,
    ),
)

MOVES = st.lists(
    st.tuples(st.floats(-4, 9), st.sampled_from([0.0, 0.02, 0.05, 0.7])), max_size=30
)


def fly(engine: TaskEngine, moves: list[tuple[float, float]]) -> list[TaskEvent]:
    events: list[TaskEvent] = []
    time_s = 0.0
    for x, after_s in moves:
        time_s += after_s
        now = replace(at((x, 0, 0), time_s), hazards_mm={"orbit": abs(x - 4)})
        events += engine.step(now)
    return events


@given(MOVES, st.integers(0, 30))
def test_going_back_to_a_state_changes_nothing(
    moves: list[tuple[float, float]], cut: int
) -> None:
    straight = TaskEngine(LADDER, PLACES)
    expected = fly(straight, moves)
    engine = TaskEngine(LADDER, PLACES)
    states: list[tuple[EngineState, int]] = []
    events: list[TaskEvent] = []
    time_s = 0.0
    for x, after_s in moves:
        states.append((engine.checkpoint(), len(events)))
        time_s += after_s
        now = replace(at((x, 0, 0), time_s), hazards_mm={"orbit": abs(x - 4)})
        events += engine.step(now)
    assert events == expected
    if cut < len(states):
        # go back, and fly the rest once more
        state, known = states[cut]
        engine.restore(state)
        again, time_s = events[:known], sum(after for _, after in moves[:cut])
        for x, after_s in moves[cut:]:
            time_s += after_s
            now = replace(at((x, 0, 0), time_s), hazards_mm={"orbit": abs(x - 4)})
            again += engine.step(now)
        assert [e.task for e in again] == [e.task for e in expected]
        assert engine.ended() == straight.ended()


@given(MOVES)
def test_a_task_opens_after_what_comes_before_and_ends_once(
    moves: list[tuple[float, float]],
) -> None:
    engine = TaskEngine(LADDER, PLACES)
    events = fly(engine, moves)
    told = [(e.task, e.status) for e in events]
    assert len(set(told)) == len(told)
    if ("on", Status.OPEN) in told:
        assert told.index(("in", Status.DONE)) < told.index(("on", Status.OPEN))
    for task, status in told:
        if status is not Status.OPEN:
            assert told.index((task, Status.OPEN)) < told.index((task, status))
    assert [e.time_s for e in events] == sorted(e.time_s for e in events)


def test_what_is_kept_is_done_at_the_end_and_the_optional_may_stay_open() -> None:
    engine = TaskEngine(LADDER, PLACES)
    assert not engine.is_complete
    fly(engine, [(0, 0), (0, 0.05), (0, 0.05), (0, 0.05), (6.9, 0.05)])
    states = {s.name: s.status for s in engine.ended()}
    assert states == {
        "in": Status.DONE,
        "on": Status.DONE,
        "safe": Status.DONE,
        "still": Status.OPEN,
    }
    assert engine.states[2].status is Status.OPEN
    assert engine.is_complete


def test_what_failed_is_not_complete() -> None:
    engine = TaskEngine(LADDER, PLACES)
    fly(engine, [(0, 0), (0, 0.05), (0, 0.1), (5, 0.05), *[(4, 0.05)] * 6])
    assert engine.states[1].status is Status.DONE
    assert engine.states[2].status is Status.FAILED
    assert engine.states[2].why == "too long too near to orbit"
    assert not engine.is_complete


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        (
            tasks.Reach(name="a", title="a", place="ostum", radius_mm=1),
            "did you mean 'ostium'?",
        ),
        (
            tasks.Reach(
                name="a", title="a", place="ostium", radius_mm=1, after=("inn",)
            ),
            "did you mean 'in'?",
        ),
        (tasks.Survey(name="in", title="a", sites={}), "Two tasks are named 'in'"),
        (
            tasks.Follow(
                name="a", title="a", rings=(tasks.Ring("bula", (0, 1, 0), 2.0),)
            ),
            "did you mean 'bulla'?",
        ),
    ],
)
def test_what_there_is_not_is_named(wrong: tasks.Task, words: str) -> None:
    with pytest.raises(UserError, match=words.replace("?", r"\?")):
        TaskEngine((*LADDER, wrong), PLACES)


def test_a_landmark_that_is_far_is_no_place_reached() -> None:
    engine = TaskEngine(LADDER, {**PLACES, "ostium": np.array([9.0, 9.0, 9.0])})
    fly(engine, [(0, 0), (0, 0.2)])
    assert engine.states[0].progress == 0.0
