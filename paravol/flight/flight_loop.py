"""The live loop: poses in, frames out, everything recorded."""

import gc
import math
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np

from devices import DeviceError, Pose
from paravol.feedback.felt_signs import felt_signs
from paravol.feedback.touch_signs import NO_SIGNS, TouchSigns
from paravol.flight.picture_size import PictureSize
from paravol.inputs.pose_sources import EndedError, OrderedPoses
from paravol.scoring.readings import injury_text
from paravol.sessions.keyframes import Keyframes
from paravol.snapshots.operated_head import OperatedHead
from paravol.view import EndoscopeView, Frame
from renderers.scene import Camera, Change, ChangeKind
from scenarios import FrameState, Sample, Session
from scenarios.bundle import (
    EditRecord,
    EventRecord,
    FrameRecord,
    PatientRecord,
    SampleRecord,
    SessionRecorder,
)
from scenarios.instruments import Action, instrument_named
from scenarios.tasks import TaskEvent, TaskState

PATIENCE_S = 2.0
"""How long the loop waits for a pose before it reports that the device is silent. The
driver itself notices a lost line within about a second."""


STEPPING_S, BEHIND_S = 0.05, 0.5
"""How long poses of a steered scope are worked on for a frame, before some of those
that wait are left out; and poses that were measured."""

STEPPING_SHARE = 1 / 3
"""Of the time, for poses of a steered scope: the rest is for what they change, and for
the picture by which it is steered."""


@dataclass(frozen=True, slots=True)
class FrameEvent:
    """A finished frame and what it shows.

    number: counts frames from 0. pose_age_ms: from the newest pose's measurement to
    now, when the picture is there. tissue: as the frame shows it, where that was asked
    for before the frame was begun and somebody operates. cuts: counts them so far, and
    their undoing. signs: what is told of the touch. tasks: how they stand. clock_s: of
    the score.
    """

    view: FrameState
    frame: Frame
    sample: Sample
    number: int
    pose_age_ms: float
    tissue: OperatedHead | None = None
    cuts: int = 0
    signs: TouchSigns = NO_SIGNS
    tasks: tuple[TaskState, ...] = ()
    clock_s: float = 0.0


OnFrame = Callable[[FrameEvent], None]
"""Called with each finished frame, in order, not by the thread that reads poses."""


SAMPLES, TISSUE, PICTURE = STAGES = "samples", "tissue", "picture"
"""Stages of a flight; see `Timing.spent_s`."""


@dataclass(slots=True)
class Timing:
    """Gather what a flight took, frame by frame.

    frame_ms: from one finished picture to the next. pose_age_ms: from a pose's
    measurement to its finished picture. cpu_s: of all threads. spent_s: for taking
    samples in, for bringing what is drawn up to date, and for drawing pictures but for
    the end of each, which is drawn meanwhile.
    """

    frame_ms: list[float] = field(default_factory=list)
    pose_age_ms: list[float] = field(default_factory=list)
    wall_s: float = 0.0
    cpu_s: float = 0.0
    spent_s: dict[str, float] = field(
        default_factory=lambda: dict.fromkeys(STAGES, 0.0)
    )

    @property
    def fps(self) -> float:
        """Return the mean number of frames per second of wall time."""
        return len(self.frame_ms) / self.wall_s if self.wall_s > 0 else 0.0

    def figures(self) -> dict[str, Any]:
        """Return frames, fps, percentiles, cores in use and the share of each stage."""
        wall_s = max(self.wall_s, 1e-9)
        return {
            "frames": len(self.frame_ms),
            "fps": self.fps,
            "frame_ms": self.percentiles(self.frame_ms),
            "pose_age_ms": self.percentiles(self.pose_age_ms),
            "cores": self.cpu_s / wall_s,
            "shares": {name: s / wall_s for name, s in self.spent_s.items()},
        }

    @staticmethod
    def percentiles(values: list[float]) -> dict[str, float]:
        """Return the 50th, 95th and 99th percentile by name; zeros for nothing."""
        cuts = np.percentile(values, (50, 95, 99)) if values else np.zeros(3)
        return dict(zip(("p50", "p95", "p99"), (float(c) for c in cuts), strict=True))


@dataclass(frozen=True, slots=True)
class FramePacing:
    """What is given up where frames would be late.

    may_skip: nothing was measured that would be lost by leaving poses out. On a machine
    that cannot work on all of them in time some are left out of any, before anything is
    made of them; what is recorded is what was flown in any case.
    sizes: chooses the size of each picture; None for the session's.
    """

    may_skip: bool = False
    sizes: PictureSize | None = None


NO_SKIPPING = FramePacing()


@dataclass(frozen=True, slots=True)
class Listeners:
    """Who hears of a flight, before the frame that shows it.

    on_injury: of each injury, told in words; on_task: of what happens to each task;
    on_changes: of what was cut; on_left_out: how many measured poses nobody had the
    time for, each time that they have doubled.
    """

    on_injury: Callable[[str], None] = lambda _: None
    on_task: Callable[[TaskEvent], None] = lambda _: None
    on_changes: Callable[[Sequence[Change]], None] = lambda _: None
    on_left_out: Callable[[int], None] = lambda _: None


NOBODY = Listeners()


def fly(
    source: OrderedPoses,
    join: Callable[[Pose], Sample],
    session: Session,
    view: EndoscopeView,
    recorder: SessionRecorder,
    *,
    until_s: float,
    on_frame: OnFrame,
    keeps: Callable[[float], bool],
    listeners: Listeners = NOBODY,
    pace: FramePacing = NO_SKIPPING,
    keyframes: Keyframes | None = None,
    at_bite: Callable[[Sample], Sample] = lambda sample: sample,
) -> Timing:
    """Fly until a sample's time reaches `until_s`, or the source says `EndedError`.

    Every pose is recorded and scored; each frame shows the newest one. join: gives the
    sample of a pose. keeps: asked before each frame, with its time, whether the tissue
    that it shows is wanted; when the frame is finished it may be another. pace: what is
    given up to be in time. keyframes: kept on the way, for those who look at the
    recording. at_bite: returns a sample with its tool where it would bite. Errors of
    the device pass through; what was recorded before is on disk.
    """
    frames = _FrameRecorder(recorder, on_frame, session.size)
    sized = _Sized(session, view, pace.sizes)
    operated = _Operated(
        view, recorder, listeners.on_injury, listeners.on_changes, at_bite
    )
    arrived = DeadlineBatch(BEHIND_S)
    if pace.may_skip:
        arrived = DeadlineBatch(STEPPING_S, STEPPING_SHARE)
    left_out = 0
    with (
        _frozen_garbage(),
        operated.ended(session),
        _settled(view),
        suppress(EndedError),
    ):
        number = 0
        begun = time.perf_counter()
        is_over = False
        while not is_over:
            newest: tuple[Pose, Sample] | None = None
            for pose in arrived(source):
                sized.start(newest is None)
                sample = join(pose)
                # what came before the end is still shown: on a busy machine, all of it
                is_over = sample.time_s >= until_s
                if is_over:
                    break
                if sample.time_s < 0.0:
                    begun = time.perf_counter()
                    frames.start()
                    continue
                taken_s = time.perf_counter()
                session.step(sample)
                newest = pose, sample
                recorder.add(SampleRecord.of(sample, session.reading))
                frames.timing.spent_s[SAMPLES] += time.perf_counter() - taken_s
                for event in session.take_task_events():
                    told = f"{event.task}: {event.status}"
                    recorder.add(EventRecord(sample.time_s, "task", told))
                    listeners.on_task(event)
            if not pace.may_skip and arrived.left_out > 2 * left_out:
                left_out = arrived.left_out
                listeners.on_left_out(left_out)
            if newest is None:
                continue
            pose, sample = newest
            before, begun = begun, time.perf_counter()
            operated.follow(session, sample.time_s)
            shown_s = time.perf_counter()
            frames.timing.spent_s[TISSUE] += shown_s - begun
            seen = sized.view(sample)
            shown = operated.shown(session, seen, sample, keeps(sample.time_s))
            shown = replace(shown, clock_s=session.clock_s)
            if session.tasks is not None:
                shown = replace(shown, tasks=session.tasks.states)
            index = recorder.samples - 1
            if keyframes is not None:
                keyframes.follow(index, sample.time_s, sample, session)
            finish = partial(frames.finish, number, index, pose, sample, shown)
            view.begin(seen, number=number, elapsed_s=begun - before, then=finish)
            frames.timing.spent_s[PICTURE] += time.perf_counter() - shown_s
            sized.drawn()
            number += 1
    return frames.timing


class _Sized:
    """Let each view have the size that is chosen, and tell how long it took."""

    def __init__(
        self, session: Session, view: EndoscopeView, sizes: PictureSize | None
    ) -> None:
        self._session = session
        self._view = view
        self._sizes = sizes
        self._lens: Camera | None = None
        self._begun_s = 0.0
        self._skipped = 0
        if sizes is not None:
            sizes.prepare = self._prepare

    def start(self, is_first: bool) -> None:
        """Hear that a pose has come; what is waited for before it counts for nothing.

        is_first: it is the first one for a frame.
        """
        if is_first and self._sizes is not None:
            self._begun_s = time.perf_counter()
            self._skipped = self._view.views_skipped

    def view(self, sample: Sample) -> FrameState:
        """Return the view of a sample."""
        if self._sizes is None:
            return self._session.view(sample)
        edge = self._sizes.next()
        seen = self._session.view(sample, (edge, edge))
        self._lens = seen.camera
        return seen

    def drawn(self) -> None:
        """Hear that the frame is begun, and the one before it finished.

        A scope that rests costs nearly nothing, which tells nothing of its size.
        """
        now_s = time.perf_counter()
        if self._sizes is None:
            return
        if self._view.views_skipped == self._skipped:
            self._sizes.took((now_s - self._begun_s) * 1e3, now_s)
        else:
            self._sizes.rested()

    def _prepare(self, edge: int) -> None:
        """Make the tables of a size; called by a thread of its own."""
        if self._lens is not None:
            self._view.prepare(replace(self._lens, width=edge, height=edge))


HASHED_EVERY_S = 5.0
"""How often the operated patient's hash is recorded, while it changes."""

TRIED_EVERY_S = 0.15
"""How often it is looked what the tool would take."""


@dataclass(frozen=True, slots=True)
class _Shown:
    """What a frame that is begun shows; see `FrameEvent`."""

    view: FrameState
    tissue: OperatedHead | None = None
    cuts: int = 0
    signs: TouchSigns = NO_SIGNS
    tasks: tuple[TaskState, ...] = ()
    clock_s: float = 0.0


class _Operated:
    """Show and record what came of the samples since the last frame."""

    def __init__(
        self,
        view: EndoscopeView,
        recorder: SessionRecorder,
        on_injury: Callable[[str], None],
        on_changes: Callable[[Sequence[Change]], None],
        at_bite: Callable[[Sample], Sample],
    ) -> None:
        self._view, self._at_bite = view, at_bite
        self._on_changes = on_changes
        self._recorder = recorder
        self._on_injury = on_injury
        self._cuts = self._bites = self._breaks = 0
        self._taken_mm3: dict[str, float] = {}
        self._bite_mm3: dict[str, float] = {}
        self._tried_s = -math.inf
        self._hashed = 0
        self._hashed_s = -HASHED_EVERY_S

    @contextmanager
    def ended(self, session: Session) -> Iterator[None]:
        """Record, at the end, what came of samples that no frame has shown."""
        try:
            yield
        finally:
            self.follow(session, None)

    def follow(self, session: Session, time_s: float | None) -> None:
        """Bring the picture up to date; record edits, and now and then the patient.

        time_s: of the newest sample; None to leave the patient's hash out.
        """
        operation = session.operation
        if operation is None:
            return
        changes = operation.take_changes()
        cuts = sum(change.kind is ChangeKind.CUT for change in changes)
        self._cuts += cuts
        if cuts:
            self._taken_mm3 = operation.patient.books.tissues()
        self._view.apply(changes)
        self._on_changes(changes)
        if operation.lens is not None:
            self._view.lens = operation.lens.state
        for edit in operation.take_edits():
            self._recorder.add(EditRecord.of(edit))
            self._bites += instrument_named(edit.tool).action is Action.BITE
        for injury in operation.take_injuries():
            told = injury_text(injury)
            self._recorder.add(EventRecord(injury.time_s, "injury", told))
            self._on_injury(told)
        for broken in operation.feeling.figures.breaks[self._breaks :]:
            self._breaks += 1
            self._recorder.add(EventRecord(broken.time_s, "break", str(broken)))
        patient = operation.patient
        if time_s is None or time_s < self._hashed_s + HASHED_EVERY_S:
            return
        if patient.generation != self._hashed:
            self._hashed, self._hashed_s = patient.generation, time_s
            self._recorder.add(
                PatientRecord(time_s, patient.generation, patient.hash())
            )

    def shown(
        self, session: Session, view: FrameState, sample: Sample, wants_tissue: bool
    ) -> _Shown:
        """Return what the next frame shows; nothing may be cut before it is begun."""
        operation = session.operation
        if operation is None:
            return _Shown(view, signs=TouchSigns(hazard=view.hazard))
        tissue = None
        if wants_tissue:
            tissue = OperatedHead.of(operation.patient, operation.pushing)
        signs = felt_signs(operation, view.hazard, self._bites)
        if not self._tried_s <= sample.time_s < self._tried_s + TRIED_EVERY_S:
            self._tried_s = sample.time_s
            self._bite_mm3 = operation.would_take(self._at_bite(sample), sample)
        signs = replace(signs, taken_mm3=self._taken_mm3, bite_mm3=self._bite_mm3)
        return _Shown(view, tissue, self._cuts, signs)


class _FrameRecorder:
    """Record each finished frame and report it."""

    def __init__(
        self, recorder: SessionRecorder, on_frame: OnFrame, size: tuple[int, int]
    ) -> None:
        """Begin; size: of the session, which need not be written for each frame."""
        self.timing = Timing()
        self._size = size
        self._recorder = recorder
        self._on_frame = on_frame
        self.start()

    def start(self) -> None:
        """Count time from now on."""
        self._started = self._last = time.perf_counter()
        self._cpu_s = time.process_time()
        self.timing.spent_s = dict.fromkeys(STAGES, 0.0)

    def finish(
        self,
        number: int,
        index: int,
        pose: Pose,
        sample: Sample,
        shown: _Shown,
        frame: Frame,
    ) -> None:
        """Record a finished frame; index: of its sample among those recorded."""
        seen = shown.view
        before, self._last = self._last, time.perf_counter()
        age_ms = (time.monotonic() - pose.host_time_s) * 1e3
        self.timing.frame_ms.append((self._last - before) * 1e3)
        self.timing.pose_age_ms.append(age_ms)
        self.timing.wall_s = self._last - self._started
        self.timing.cpu_s = time.process_time() - self._cpu_s
        gap, print_ = seen.clearance_mm, frame.fingerprint()
        height, width = frame.pixels.shape[:2]
        size = 0 if (width, height) == self._size else width
        record = FrameRecord(number, index, frame.gain, gap, print_, size=size)
        self._recorder.add(record)
        kept = shown.tissue, shown.cuts, shown.signs, shown.tasks, shown.clock_s
        self._on_frame(FrameEvent(seen, frame, sample, number, age_ms, *kept))


@contextmanager
def _settled(view: EndoscopeView) -> Iterator[None]:
    """Wait, at the end, for the frame in progress."""
    try:
        yield
    finally:
        view.settle()


@contextmanager
def _frozen_garbage() -> Iterator[None]:
    """Exclude the objects that exist already from garbage collection.

    The compiler leaves half a million; a collection that visits them takes as long as
    several frames. What lies there unused is left until the flight is over: to look for
    it would keep a window waiting for a second.
    """
    gc.freeze()
    try:
        yield
    finally:
        gc.unfreeze()


def thinned(poses: Sequence[Pose], most: int, buttons: int = 0) -> list[Pose]:
    """Leave out poses where there are more than `most`, evenly; the last one stays.

    So do those whose buttons differ from the pose's before: no click is lost. buttons:
    of the pose before the first.
    """
    if len(poses) <= most:
        return list(poses)
    kept = []
    for n, pose in enumerate(poses):
        is_turn = (n + 1) * most // len(poses) > n * most // len(poses)
        if is_turn or pose.buttons != buttons:
            kept.append(pose)
        buttons = pose.buttons
    return kept


class DeadlineBatch:
    """Wait for one pose, then give those that came meanwhile, as many as there is time.

    What one takes is known from the frame before. Nothing is left out but places on the
    way, and no click: somebody who steers by the picture is helped by no older one.

    left_out: how many were, so far.
    """

    def __init__(self, allowed_s: float = STEPPING_S, share: float = 1.0) -> None:
        """Begin; allowed_s: for all that are given at once. share: of all time."""
        self._allowed_s, self._share = allowed_s, share
        self._looked_s = -math.inf
        # until that is known; what waits before the first picture is of no use
        self._each_s = STEPPING_S / 5
        self._buttons = 0
        self.left_out = 0

    def __call__(self, source: OrderedPoses) -> Iterator[Pose]:
        waiting = [source.read(PATIENCE_S)]
        begun_s = time.monotonic()
        ended: Exception | None = None
        try:
            while waiting[-1].host_time_s < begun_s:
                waiting.append(source.read(0.0))
        except TimeoutError:
            pass
        except (EndedError, EOFError, DeviceError) as error:
            # what came before the end is still shown
            ended = error
        since_s, self._looked_s = begun_s - self._looked_s, begun_s
        allowed_s = min(self._allowed_s, self._share * since_s)
        most = len(waiting)
        if self._each_s * most > allowed_s:
            most = max(int(allowed_s / self._each_s), 1)
        kept = thinned(waiting, most, self._buttons)
        self.left_out += len(waiting) - len(kept)
        self._buttons = waiting[-1].buttons
        yield from kept
        self._each_s = (time.monotonic() - begun_s) / len(kept)
        if ended is not None:
            raise ended
