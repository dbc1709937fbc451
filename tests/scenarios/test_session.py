"""A session of samples: the score's clock, and tasks that follow it."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scenarios import Sample, Session
from scenarios.endoscope import Endoscope, tip_frame
from scenarios.instrument_state import EMPTY_HAND
from scenarios.tasks import Status, TaskEngine
from scenarios.tasks import task as tasks
from surgery.film import BleedingRate
from tests.scenarios.recorded_hand import operation_on
from tests.surgery.heads import floor_at
from tests.surgery.pouring import bleed_from

ABOVE = np.array([12.0, 11.0, 18.0])
DOWN = np.array([0.0, 0.0, -1.0])


def sample(time_s: float, is_frozen: bool = False) -> Sample:
    frame = tip_frame(ABOVE, DOWN)
    far = np.full(3, np.nan)
    return Sample(time_s, frame, 0.0, far, DOWN, 0, EMPTY_HAND, is_frozen)


def session() -> Session:
    stay = tasks.Reach(
        name="stay", title="Stay", place=(12.0, 11.0, 18.0), radius_mm=1.0, hold_s=1.0
    )
    distance = floor_at(10.0).distance
    engine = TaskEngine((stay,), {})
    return Session(Endoscope(), np.eye(4), distance, {}, (8, 8), tasks=engine)


@given(st.lists(st.tuples(st.floats(0.001, 0.4), st.booleans()), min_size=2))
def test_the_clock_stands_between_samples_of_which_one_is_frozen(
    steps: list[tuple[float, bool]],
) -> None:
    flown = session()
    time_s = stood_s = 0.0
    was_frozen: bool | None = None
    for after_s, is_frozen in steps:
        time_s += after_s
        if was_frozen is not None and (was_frozen or is_frozen):
            stood_s += after_s
        was_frozen = is_frozen
        flown.step(sample(time_s, is_frozen))
        assert flown.clock_s == pytest.approx(time_s - stood_s)


@given(st.sampled_from([None, 0.0, 30.0, 45.0, 70.0]), st.sampled_from([0.0, 30.0]))
def test_a_sample_is_seen_by_the_scope_that_it_names(
    scope_deg: float | None, own_deg: float
) -> None:
    distance = floor_at(10.0).distance
    flown = Session(Endoscope(angle_deg=own_deg), np.eye(4), distance, {}, (8, 8))
    frame = tip_frame(ABOVE, np.array([0.0, 1.0, 0.0]))
    seen = flown.view(replace(sample(0.0), device_from_tip=frame, scope_deg=scope_deg))
    angle_deg = own_deg if scope_deg is None else scope_deg
    assert seen.scope_deg == angle_deg
    turn = np.radians(angle_deg)
    expected = np.array([0.0, np.cos(turn), np.sin(turn)])
    np.testing.assert_allclose(seen.camera.frame[3], expected, atol=1e-12)
    # the shaft is where it was
    np.testing.assert_array_equal(seen.world_from_tip, frame)


def test_what_is_frozen_counts_neither_for_tasks_nor_for_the_score() -> None:
    whole, halved = session(), session()
    for n in range(12):
        whole.step(sample(0.1 * n))
        halved.step(sample(0.1 * n if n < 6 else 30.0 + 0.1 * n))
        if n == 5:
            halved.step(sample(0.6, is_frozen=True))
            halved.step(sample(30.6, is_frozen=True))
            assert not any(s.status is Status.DONE for s in halved.score().tasks)
    assert [e.status for e in whole.take_task_events()] == [Status.OPEN, Status.DONE]
    assert [e.status for e in halved.take_task_events()] == [Status.OPEN, Status.DONE]
    # the sample after the last frozen one begins the count again
    assert whole.score().duration_s == pytest.approx(1.1)
    assert halved.score().duration_s == pytest.approx(1.0)


def test_nothing_bleeds_and_nothing_is_cut_while_frozen() -> None:
    operation = operation_on()
    cut = Session(
        Endoscope(),
        np.eye(4),
        operation.patient.surface.distance,
        {},
        (8, 8),
        operation=operation,
    )

    def held(time_s: float, jaw: float, is_frozen: bool) -> Sample:
        hand = replace(EMPTY_HAND, name="straight forceps", jaw=jaw, is_working=True)
        tip = np.array([12.0, 11.0, 10.0])
        return replace(
            sample(time_s, is_frozen), instrument_tip_mm=tip, instrument=hand
        )

    cut.step(held(0.0, 0.0, False))
    cut.step(held(0.1, 0.0, True))
    cut.step(held(0.2, 1.0, True))
    assert operation.patient.edits == 0
    cut.step(held(0.3, 0.0, False))
    cut.step(held(0.4, 1.0, False))
    assert operation.patient.edits == 1
    bleed_from(operation.film, (12.0, 11.0, 10.0), BleedingRate(0.6, 2.0))
    for n in range(10):
        cut.step(held(0.5 + 0.1 * n, 1.0, False))
    bled = operation.film.books.bled_ml
    assert bled > 0.0
    cut.step(held(100.0, 1.0, True))
    assert operation.film.books.bled_ml == bled
    cut.step(held(100.1, 1.0, False))
    assert bled < operation.film.books.bled_ml < 2 * bled
