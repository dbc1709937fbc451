"""Poses on their way into frames."""

import hashlib
import itertools
import time
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from devices import Pose
from paravol.flight_loop import FrameEvent, _arrived, fly
from paravol.view import Frame
from renderers.scene import ChangeKind, GBuffer
from renderers.scene.lens_state import CLEAN, LensState
from renderers.scene.thread_team import Errand, ThreadTeam
from scenarios import Sample
from scenarios.bundle import EventRecord, FrameRecord, SampleRecord
from scenarios.feeling import Feeling, FeltFigures
from surgery.edit import Taker
from surgery.force import NO_TOUCH
from surgery.injury import Injury
from surgery.solids import capsule
from tests.surgery.heads import soft_patient

WALL = "lamina papyracea"


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
    assert list(_arrived(Waiting(sent.copy()))) == sent


def test_a_frame_is_drawn_however_fast_poses_come() -> None:
    """Those who are slower than the device fall behind, but they come to an end."""
    taken = list(itertools.islice(_arrived(Endless()), 1000))
    assert len(taken) < 5


def test_no_pose_is_lost_between_two_frames() -> None:
    now = time.monotonic()
    # measured before and after the look
    sent = [pose(now - 1.0), pose(now + 50.0), pose(now + 100.0)]
    source = Waiting(sent.copy())
    assert list(_arrived(source)) == sent[:2]
    assert list(_arrived(source)) == sent[2:]


class Slow:
    """Frames that take their time, finished by another thread."""

    def __init__(self) -> None:
        self._team = ThreadTeam(2)
        self._begun: Errand[Frame] | None = None
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
        self._begun = self._team.start(finish)

    def settle(self) -> None:
        begun, self._begun = self._begun, None
        if begun is not None:
            begun.result()


class Still:
    """A session in which nothing happens."""

    operation: Any = None
    tasks: Any = None

    def step(self, sample: Sample) -> None:
        pass

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
        edit = self.patient.carve(capsule(at, at, 1.0), Taker())
        assert edit is not None
        self.state = LensState(soil=sample.time_s / 100)
        if sample.time_s in (3.0, 5.0):
            self.injuries.append(
                Injury(sample.time_s, "orbit", WALL, "right", at, 1.0, "curette")
            )
        self.changes = [edit.change, replace(edit.change, kind=ChangeKind.FILM)]

    def take_changes(self) -> list[Any]:
        return self.changes

    def take_edits(self) -> list[Any]:
        return []

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
            Marks(),
            any_session,
            any_view,
            any_kept,
            until_s=20.0,
            on_frame=on_frame,
            keeps=keeps,
            on_injury=on_injury,
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
    for record, shown in zip(frames, told, strict=True):
        # whatever was measured while the frame was in the making
        assert samples[record.sample].time_s == shown.sample.time_s
        assert record.clearance_mm == shown.sample.time_s
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
        assert event.frame.lens == LensState(soil=event.sample.time_s / 100)


def test_a_frame_tells_what_its_sample_felt() -> None:
    class Breaking(Operating):
        """A session in which the fourth sample breaks a wall."""

        def step(self, sample: Sample) -> None:
            super().step(sample)
            if sample.time_s >= 4.0:
                self.feeling.figures = FeltFigures(broken=(WALL,))

    frames: list[FrameEvent] = []
    flown(frames.append, Breaking())
    for event in frames:
        time_s = event.sample.time_s
        assert event.signs.hazard == ("orbit", time_s)
        assert event.signs.force_n == 0.0
        assert event.signs.breaks == (time_s >= 4.0)
        assert event.signs.broken == (WALL if time_s >= 4.0 else "")
    frames.clear()
    flown(frames.append)
    # without an operation nobody computes a force
    assert {event.signs.force_n for event in frames} == {None}
