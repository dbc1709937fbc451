"""Poses on their way into frames."""

import hashlib
import itertools
import time
from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from devices import Pose
from paravol.flight import flight_loop
from paravol.flight.flight_loop import (
    BEHIND_S,
    STEPPING_SHARE,
    DeadlineBatch,
    FrameEvent,
    FramePacing,
    Listeners,
    fly,
    thinned,
)
from paravol.view import Frame
from renderers.scene import ChangeKind, GBuffer
from renderers.scene.lens_state import CLEAN, LensState
from renderers.scene.thread_pool import Future, ThreadPool
from scenarios import Sample
from scenarios.bundle import EventRecord, FrameRecord, SampleRecord
from scenarios.feeling import Feeling, FeltFigures
from scenarios.reading import Reading
from scenarios.scoring import BreakFigure
from surgery.edit import CuttingLimits
from surgery.force import NO_TOUCH
from surgery.injury import Injury
from surgery.solids import capsule
from tests.surgery.heads import soft_patient

WALL = "lamina papyracea"
BREAK = BreakFigure(4.0, WALL, 6.0, "curette")


def pose(host_time_s: float) -> Pose:
    return Pose(host_time_s, host_time_s, np.eye(4), 0)


class Waiting:
    """Poses that are there already."""

    def __init__(self, poses: list[Pose]) -> None:
        self.poses = poses

    def read(self, timeout_s: float) -> Pose:
        if not self.poses:
            raise TimeoutError("silence")
        return self.poses.pop(0)


class Endless:
    """A device that has measured again whenever it is asked."""

    def read(self, timeout_s: float) -> Pose:
        return pose(time.monotonic())


def test_a_frame_takes_all_poses_that_are_there() -> None:
    now = time.monotonic()
    sent = [pose(now - 0.01 * (9 - i)) for i in range(10)]
    assert list(DeadlineBatch(BEHIND_S)(Waiting(sent.copy()))) == sent


def test_a_frame_is_drawn_however_fast_poses_come() -> None:
    taken = list(itertools.islice(DeadlineBatch()(Endless()), 1000))
    assert len(taken) < 5


def test_no_pose_is_lost_between_two_frames() -> None:
    now = time.monotonic()
    # measured before and after the look
    sent = [pose(now - 1.0), pose(now + 50.0), pose(now + 100.0)]
    source, batch = Waiting(sent.copy()), DeadlineBatch()
    assert list(batch(source)) == sent[:2]
    assert list(batch(source)) == sent[2:]
    assert batch.left_out == 0


class Slow:
    """Frames that take their time, finished by another thread."""

    views_skipped = 0

    def __init__(self) -> None:
        self._pool = ThreadPool(2)
        self._begun: Future[Frame] | None = None
        self.lens = CLEAN

    def apply(self, changes: Any) -> None:
        pass

    def begin(self, seen: Any, *, then: Any, **_: Any) -> Any:
        lens = self.lens

        def finish() -> Any:
            time.sleep(0.002)
            empty = GBuffer.empty(2, 2)
            then(Frame(np.zeros((2, 2, 3), np.uint8), empty, 0.5, lens))

        self.settle()
        self._begun = self._pool.start(finish)

    def settle(self) -> None:
        begun, self._begun = self._begun, None
        if begun is not None:
            begun.result()


class Still:
    """A session in which nothing happens."""

    operation: Any = None
    tasks: Any = None
    size = (2, 2)
    clock_s = 0.0
    reading: Reading | None = None

    def step(self, sample: Sample) -> None:
        self.clock_s = sample.time_s / 2
        self.reading = Reading(sample.time_s)

    def take_task_events(self) -> list[Any]:
        return []

    def view(self, sample: Sample) -> Any:
        return SimpleNamespace(
            clearance_mm=sample.time_s, hazard=("orbit", sample.time_s)
        )


def digest_of(values: NDArray[Any]) -> str:
    return hashlib.sha256(values.tobytes()).hexdigest()


class Operating(Still):
    """A session whose every sample takes tissue away.

    shown: the distance as each view was asked for.
    """

    def __init__(self) -> None:
        self.patient = soft_patient()
        self.operation = self
        self.pushing = None
        self.lens = self
        self.state = CLEAN
        self.feeling = Feeling(self.patient)
        self.touch = self.scope_touch = NO_TOUCH
        self.injuries: list[Injury] = []
        self.shown: dict[float, str] = {}

    def step(self, sample: Sample) -> None:
        at = np.array([4.0 + 0.5 * sample.time_s, 10.0, 10.0])
        edit = self.patient.carve(capsule(at, at, 1.0), CuttingLimits())
        assert edit is not None
        self.state = LensState(fog=sample.time_s / 100)
        if sample.time_s in (3.0, 5.0):
            self.injuries.append(
                Injury(sample.time_s, "orbit", WALL, "right", at, 1.0, "curette")
            )
        self.changes = [edit.change, replace(edit.change, kind=ChangeKind.FILM)]

    def take_changes(self) -> list[Any]:
        return self.changes

    def take_edits(self) -> list[Any]:
        return []

    def would_take(self, sample: Sample, now: Sample) -> dict[str, float]:
        return {"mucosa": sample.time_s}

    def take_injuries(self) -> list[Injury]:
        taken, self.injuries = self.injuries, []
        return taken

    def view(self, sample: Sample) -> Any:
        self.shown[sample.time_s] = digest_of(self.patient.surface.distance.values)
        return super().view(sample)


class Kept:
    """What would be recorded."""

    def __init__(self) -> None:
        self.records: list[Any] = []

    @property
    def samples(self) -> int:
        return sum(isinstance(r, SampleRecord) for r in self.records)

    def add(self, record: Any) -> None:
        self.records.append(record)


class Marks:
    """A second channel that does nothing."""

    def complete(self, pose: Pose) -> Sample:
        zero = np.zeros(3)
        return Sample(pose.time_s, pose.device_from_tip, 0.0, zero, zero, 0)


def flown(
    on_frame: Any,
    session: Any = None,
    keeps: Any = lambda time_s: False,
    on_injury: Any = lambda text: None,
) -> tuple[Any, Kept]:
    """Fly over 20 poses that are measured when they are read."""
    times = iter(np.arange(-2, 30).tolist())

    class Measured:
        def read(self, timeout_s: float) -> Pose:
            if timeout_s == 0.0:
                raise TimeoutError
            return Pose(next(times), time.monotonic(), np.eye(4), 0)

    kept, view = Kept(), Slow()
    any_view: Any = view
    any_kept: Any = kept
    any_session: Any = session or Still()
    try:
        timing = fly(
            Measured(),
            Marks().complete,
            any_session,
            any_view,
            any_kept,
            until_s=20.0,
            on_frame=on_frame,
            keeps=keeps,
            listeners=Listeners(on_injury),
        )
    finally:
        assert view._begun is None
    return timing, kept


def test_every_frame_is_recorded_and_told_once_in_order() -> None:
    told: list[FrameEvent] = []
    timing, kept = flown(told.append)
    frames = [r for r in kept.records if isinstance(r, FrameRecord)]
    assert kept.samples == len(frames) == len(told) == len(timing.frame_ms) == 20
    assert [f.number for f in frames] == [s.number for s in told] == list(range(20))
    samples = [r for r in kept.records if isinstance(r, SampleRecord)]
    # with what was measured there
    assert [s.reading for s in samples] == [Reading(s.time_s) for s in samples]
    for record, shown in zip(frames, told, strict=True):
        # whatever was measured while the frame was in the making
        assert samples[record.sample].time_s == shown.sample.time_s
        assert record.clearance_mm == shown.sample.time_s
        assert shown.clock_s == shown.sample.time_s / 2
    assert sum(timing.frame_ms) / 1e3 == pytest.approx(timing.wall_s)
    assert all(age >= 2.0 for age in timing.pose_age_ms)


def test_a_frame_brings_the_tissue_that_it_shows() -> None:
    """Where that is asked for, although more is cut before the frame is finished."""
    told: list[FrameEvent] = []
    session = Operating()
    flown(told.append, session, lambda time_s: time_s % 3 == 0)
    before = session.patient.pristine.distance.values
    last = digest_of(session.patient.surface.distance.values)
    for event in told:
        time_s = event.sample.time_s
        assert (event.tissue is not None) == (time_s % 3 == 0)
        assert event.cuts == 1 + event.number
        if event.tissue is not None:
            assert event.tissue.surface.distance is not None
            found = digest_of(event.tissue.surface.distance.applied(before))
            assert found == session.shown[time_s]
            assert found != last


def test_an_error_in_telling_ends_the_flight() -> None:
    def fail(shown: FrameEvent) -> None:
        if shown.number == 19:
            raise OSError("nobody listens")

    with pytest.raises(OSError, match="nobody listens"):
        flown(fail)


def test_injuries_are_recorded_and_told_once_each() -> None:
    told: list[str] = []
    _, kept = flown(lambda event: None, Operating(), on_injury=told.append)
    events = [r for r in kept.records if isinstance(r, EventRecord)]
    words = f"orbit, right: through the {WALL}, by the curette"
    assert told == [event.text for event in events] == [words, words]
    assert [(e.time_s, e.kind) for e in events] == [(3.0, "injury"), (5.0, "injury")]


def test_a_frame_shows_the_lens_as_its_sample_left_it() -> None:
    frames: list[FrameEvent] = []
    flown(frames.append, Operating())
    assert len(frames) == 20
    for event in frames:
        assert event.frame.lens == LensState(fog=event.sample.time_s / 100)


def test_a_frame_tells_what_its_sample_felt() -> None:
    class Breaking(Operating):
        """A session in which the fourth sample breaks a wall."""

        def step(self, sample: Sample) -> None:
            super().step(sample)
            if sample.time_s >= 4.0:
                self.feeling.figures = FeltFigures(breaks=(BREAK,))

    frames: list[FrameEvent] = []
    _, kept = flown(frames.append, Breaking())
    breaks = [r for r in kept.records if isinstance(r, EventRecord)]
    assert [(r.time_s, r.text) for r in breaks if r.kind == "break"] == [
        (4.0, f"{WALL}, at 6.0 N by the curette")
    ]
    for event in frames:
        time_s = event.sample.time_s
        assert event.signs.hazard == ("orbit", time_s)
        assert event.signs.force_n == 0.0
        assert event.signs.bite_mm3 == {"mucosa": time_s}
        assert event.signs.breaks == (time_s >= 4.0)
        assert event.signs.broken == (WALL if time_s >= 4.0 else "")
    frames.clear()
    flown(frames.append)
    # without an operation nobody computes a force
    assert {event.signs.force_n for event in frames} == {None}


class Passing:
    """A clock that stands until somebody works, for the loop and for its source."""

    def __init__(self) -> None:
        self.at_s = 50.0

    def now(self) -> float:
        return self.at_s

    def sleep(self, seconds: float) -> None:
        self.at_s += seconds

    monotonic = perf_counter = process_time = now


class Hundredfold:
    """A scope that is steered 100 times a second; button 1 is clicked for one pose."""

    def __init__(self, clock: Passing) -> None:
        self.clock = clock
        self.given = 0

    def read(self, timeout_s: float) -> Pose:
        due_s = 50.0 + (self.given + 1) / 100
        if due_s > self.clock.at_s + timeout_s:
            raise TimeoutError
        self.clock.at_s = max(self.clock.at_s, due_s)
        self.given += 1
        clicks = int(self.given % 100 == 37)
        return Pose(self.given / 100, due_s, np.eye(4), clicks)


def steered(
    monkeypatch: pytest.MonkeyPatch,
    step_s: float,
    frame_s: float,
    may_skip: bool,
    on_left_out: Callable[[int], None] = lambda _: None,
) -> tuple[list[float], Kept, list[float], set[float]]:
    """Fly 10 s on a machine that takes so long for a sample and for a frame.

    Returns the ages of shown poses, what was recorded, what was stepped, clicks.
    """
    clock = Passing()
    stepped: list[float] = []
    clicks: set[float] = set()

    class Working(Still):
        def step(self, sample: Sample) -> None:
            clock.sleep(step_s)
            stepped.append(sample.time_s)
            if sample.buttons:
                clicks.add(sample.time_s)

    class Drawing:
        lens = CLEAN
        views_skipped = 0

        def apply(self, changes: Any) -> None:
            pass

        def settle(self) -> None:
            pass

        def begin(self, seen: Any, *, then: Any, **_: Any) -> None:
            clock.sleep(frame_s)
            empty = GBuffer.empty(2, 2)
            then(Frame(np.zeros((2, 2, 3), np.uint8), empty, 0.5, CLEAN))

    class Buttons(Marks):
        def complete(self, pose: Pose) -> Sample:
            return replace(super().complete(pose), buttons=pose.buttons)

    monkeypatch.setattr(flight_loop, "time", clock)
    kept = Kept()
    any_view: Any = Drawing()
    any_kept: Any = kept
    any_session: Any = Working()
    ages: list[float] = []
    fly(
        Hundredfold(clock),
        Buttons().complete,
        any_session,
        any_view,
        any_kept,
        until_s=10.0,
        on_frame=lambda event: ages.append(event.pose_age_ms / 1e3),
        keeps=lambda time_s: False,
        pace=FramePacing(may_skip),
        listeners=Listeners(on_left_out=on_left_out),
    )
    return ages, kept, stepped, clicks


@pytest.mark.parametrize("frame_s", [0.0, 0.02, 0.1])
def test_a_slow_machine_does_not_fall_behind_a_steered_scope(
    monkeypatch: pytest.MonkeyPatch, frame_s: float
) -> None:
    """A sample takes three times as long as it stands for."""
    ages, kept, stepped, clicks = steered(monkeypatch, 0.03, frame_s, True)
    # from one look to the next, and what is done for the pose itself
    assert max(ages[1:]) < 2 * (0.05 + 0.03 + frame_s)
    assert max(ages[len(ages) // 2 :]) <= max(ages[1 : len(ages) // 2]) + 0.011
    assert stepped[-1] > 9.5
    assert np.all(np.diff(stepped) > 0)
    # what was flown is what is recorded, and no click is lost
    samples = [r for r in kept.records if isinstance(r, SampleRecord)]
    assert [r.time_s for r in samples] == stepped
    assert sorted(clicks) == pytest.approx([n + 0.37 for n in range(10)])
    # measured poses are thinned later, and that is told
    left_out: list[int] = []
    ages, _, stepped, _ = steered(monkeypatch, 0.03, frame_s, False, left_out.append)
    assert max(ages[1:]) < 2 * (BEHIND_S + 0.03 + frame_s)
    assert left_out[-1] > 200
    assert all(2 * a < b for a, b in itertools.pairwise(left_out))


def test_a_quick_machine_leaves_nothing_out(monkeypatch: pytest.MonkeyPatch) -> None:
    """Not even where frames take long."""
    for step_s, frame_s in ((0.001, 0.01), (0.003, 0.1)):
        _, _, stepped, clicks = steered(monkeypatch, step_s, frame_s, True)
        np.testing.assert_allclose(stepped, np.arange(1, len(stepped) + 1) / 100)
        assert len(stepped) >= 985
        assert len(clicks) == 10


def test_samples_of_a_steered_scope_leave_time_for_pictures(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Where all would take half of it; of an arm they are all taken."""
    _, kept, stepped, _ = steered(monkeypatch, 0.005, 0.015, True)
    frames = sum(isinstance(r, FrameRecord) for r in kept.records)
    assert 0.005 * len(stepped) < (STEPPING_SHARE + 0.05) * 10.0
    assert frames > 0.95 * (1 - STEPPING_SHARE) * 10.0 / 0.015
    _, _, stepped, _ = steered(monkeypatch, 0.005, 0.015, False)
    assert len(stepped) >= 985


def test_after_a_standstill_a_steered_scope_is_where_the_hand_is(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    ages, _, stepped, _ = steered(monkeypatch, 0.006, 3.0, True)
    # the last one was the last before the end
    assert max(ages[1:-1]) < 3.0 + 0.1
    assert len(stepped) < 100


@given(
    buttons=st.lists(st.integers(0, 1), min_size=1, max_size=40),
    most=st.integers(1, 50),
)
def test_poses_are_left_out_evenly(buttons: list[int], most: int) -> None:
    poses = [Pose(n, n, np.eye(4), b) for n, b in enumerate(buttons)]
    kept = thinned(poses, most)
    edges = {n for n, b in enumerate(buttons) if b != [0, *buttons][n]}
    at = [int(p.time_s) for p in kept]
    assert at == sorted(set(at))
    assert at[-1] == len(poses) - 1
    assert edges <= set(at)
    assert min(most, len(poses)) <= len(at) <= min(most, len(poses)) + len(edges)
    assert max(np.diff([-1, *at])) <= -(-len(poses) // most)
