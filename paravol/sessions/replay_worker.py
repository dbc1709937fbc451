"""A thread that shows any moment of a recorded session: the newest wish wins.

It knows no window. Whoever looks on says what is wanted and hears `ReplayEvent`s.
"""

import threading
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from paravol.debrief.events import events_of
from paravol.debrief.findings import gather
from paravol.feedback.hazard_pointer import hazard_pointer
from paravol.flight.flight_events import HeadLoaded, Progressed
from paravol.patient import PatientScene
from paravol.scoring.metric_texts import metric_text, says_nothing
from paravol.sessions.free_camera import CameraMove, FreeCamera
from paravol.sessions.replay_events import (
    HearReplay,
    Measured,
    Measuring,
    Near,
    NotesChanged,
    OpenedReplay,
    ReplayFailed,
    ReplayOrder,
    Row,
    Seeking,
    ShownReplay,
    Told,
    Unmeasured,
)
from paravol.sessions.session_alignment import TimeMap, align, by_time, session_marks
from paravol.sessions.session_pictures import SessionPictures
from paravol.sessions.session_setup import MissingCaseError
from paravol.sessions.time_marks import measured_marks, recorded_marks
from paravol.slices.cutaway import Cutaway
from paravol.snapshots.moments import SnapshotRequestFactory
from paravol.snapshots.snapshot_queue import SnapshotQueue
from scenarios import Scenario
from scenarios.bundle import SampleRecord, add_note, read_notes, remove_note
from scenarios.metrics import Metric, Settings
from system import UserError

LONG_S = 0.3
"""A way that takes longer is told while it lasts."""

WAY_PLACES = 50
"""Of the scope's way that the head is cut open beside."""


class _Stopped(BaseException):
    """Nobody looks on any longer."""


class _Overtaken(BaseException):
    """A newer moment is wanted."""


@dataclass(slots=True)
class _Wishes:
    """Gather what is wanted next.

    time_s: None where nothing new. jump: counts jumps; `time_s` is that of the last.
    """

    time_s: float | None = None
    jump: int = 0
    is_free: bool = False
    move: CameraMove | None = None
    is_stale: bool = False
    by_landmarks: bool = True
    keeps: int = 0
    notes: list[tuple[float, str]] = field(default_factory=list)
    removed: list[int] = field(default_factory=list)

    @property
    def is_any(self) -> bool:
        return bool(
            self.time_s is not None
            or self.move is not None
            or self.is_stale
            or self.keeps
            or self.notes
            or self.removed
        )


class ReplayWorker:
    """Show a session's moments in a thread of its own.

    All methods may be called by any thread, and return at once.
    """

    def __init__(self, order: ReplayOrder, hear: HearReplay) -> None:
        """Do nothing until `start`."""
        self.order = order
        self.pristine: PatientScene | None = None
        """The head before anybody operated; None until it is loaded."""
        self._hear = hear
        self._wishes = _Wishes()
        self._changed = threading.Condition()
        self._stopped = threading.Event()
        self._queue: SnapshotQueue | None = None
        self._here: SessionPictures | None = None
        self._there: SessionPictures | None = None
        self._maps: dict[bool, TimeMap] = {}
        self._free: FreeCamera | None = None
        self._shown: ShownReplay | None = None
        self._jump = 0
        self._kept = 0
        # daemons: a kernel that is just being compiled must not keep the program
        self._threads = [
            threading.Thread(target=work, name=name, daemon=True)
            for work, name in ((self._run, "replay"), (self._measure, "measuring"))
        ]
        self._is_first_shown = threading.Event()
        self._is_still = threading.Event()
        self._is_still.set()

    @property
    def scenario(self) -> Scenario:
        """Return what was flown; once the session is opened."""
        assert self._here is not None
        return self._here.scenario

    def cutter(self) -> Callable[[], Cutaway]:
        """Prepare to cut the head open beside the way that the scope took."""
        assert self._here is not None
        timeline = self._here.timeline
        matrix = np.array(timeline.recording.info.world_from_device).reshape(4, 4)
        records = timeline.recording.records
        poses = [r.device_from_tip for r in records if isinstance(r, SampleRecord)]
        chosen = poses[:: max(len(poses) // WAY_PLACES, 1)]
        places = np.array(chosen).reshape(-1, 4, 4)[:, :3, 3] @ matrix[:3, :3].T
        return partial(Cutaway, timeline.patient.scene, places + matrix[:3, 3])

    def start(self) -> None:
        """Begin to open the session."""
        self._threads[0].start()

    def stop(self, patience_s: float) -> bool:
        """End all that goes on; return whether it ended in time."""
        self._stopped.set()
        with self._changed:
            self._changed.notify_all()
        self._is_first_shown.set()
        until = time.monotonic() + patience_s
        for thread in self._threads:
            if thread.ident is not None:
                thread.join(max(until - time.monotonic(), 0.0))
        if self._queue is not None:
            self._queue.close()
        return not any(thread.is_alive() for thread in self._threads)

    def show(self, time_s: float) -> None:
        """Show a moment once what is being drawn is shown: for a playback."""
        self._wish(time_s=time_s)

    def jump_to(self, time_s: float) -> int:
        """Go to a moment now, whatever is on its way; return the jump's number."""
        with self._changed:
            self._wishes.time_s = time_s
            self._wishes.jump += 1
            self._changed.notify_all()
            return self._wishes.jump

    def leave_view(self, is_free: bool) -> None:
        """Leave the recorded view, or come back to it."""
        self._wish(is_free=is_free, is_stale=True)

    def look(self, move: CameraMove) -> None:
        """Turn and move the camera that left the recorded view."""
        with self._changed:
            before = self._wishes.move
            self._wishes.move = move if before is None else before.then(move)
            self._changed.notify_all()

    def align_by(self, *, landmarks: bool) -> None:
        """Tie the sessions together by landmarks and tasks, or by time alone."""
        self._wish(by_landmarks=landmarks, is_stale=True)

    def keep(self) -> None:
        """Have what is shown drawn at high quality."""
        with self._changed:
            self._wishes.keeps += 1
            self._changed.notify_all()

    def note(self, at_s: float, text: str) -> None:
        """Write a note on the session."""
        with self._changed:
            self._wishes.notes.append((at_s, text))
            self._changed.notify_all()

    def remove_note(self, number: int) -> None:
        """Remove the note of this number, from 1 on."""
        with self._changed:
            self._wishes.removed.append(number)
            self._changed.notify_all()

    def _wish(self, **wanted: object) -> None:
        with self._changed:
            self._wishes = replace(self._wishes, **wanted)  # type: ignore[arg-type]
            self._changed.notify_all()

    # what follows is called by the thread that shows

    def _run(self) -> None:
        try:
            self._hear(self._open())
            self._threads[1].start()
            while True:
                self._obey(self._next())
        except _Stopped:
            # what was written meanwhile is not lost
            self._write(self._wishes)
        except Exception as error:
            if not self._stopped.is_set():
                lacks_case = isinstance(error, MissingCaseError)
                self._hear(ReplayFailed(error, lacks_case))

    def _open(self) -> OpenedReplay:
        order = self.order
        here = SessionPictures(
            order.folder,
            progress=self._progress,
            size=order.size,
            case=order.case,
            threads=order.threads,
            patient=order.patient,
        )
        self._here, self.pristine = here, here.patient
        timeline = here.timeline
        ends = timeline.begin_s, timeline.end_s
        names: tuple[str, ...] = ()
        if order.beside is not None:
            self._there = there = SessionPictures(
                order.beside,
                progress=self._progress,
                size=order.size,
                case=None,
                threads=order.threads,
                patient=here.patient,
            )
            other = there.timeline
            theirs = other.begin_s, other.end_s
            self._maps = {
                False: by_time(ends, theirs),
                True: align(
                    session_marks(timeline.recording, here.patient.landmarks),
                    session_marks(other.recording, there.patient.landmarks),
                    ends,
                    theirs,
                ),
            }
            names = self._maps[True].names
        recording = timeline.recording
        return OpenedReplay(
            order,
            here.scenario,
            timeline.frame_times_s or timeline.sample_times_s,
            *ends,
            recorded_marks(recording.records),
            read_notes(order.folder),
            names,
            recording.complete,
            bool(recording.damages),
        )

    def _progress(self, stage: str, share: float) -> None:
        if self._stopped.is_set():
            raise _Stopped
        self._hear(Progressed(stage, share))

    def _next(self) -> _Wishes:
        """Wait until something is wanted, and take it."""
        with self._changed:
            while not self._wishes.is_any and not self._stopped.is_set():
                self._changed.wait()
            if self._stopped.is_set():
                raise _Stopped
            taken = self._wishes
            self._wishes = _Wishes(
                jump=taken.jump,
                is_free=taken.is_free,
                by_landmarks=taken.by_landmarks,
            )
        return taken

    def _obey(self, wishes: _Wishes) -> None:
        # what is shown is wanted, not what comes next
        for _ in range(wishes.keeps):
            self._keep()
        self._write(wishes)
        moved = wishes.time_s is not None or wishes.move is not None or wishes.is_stale
        if moved:
            try:
                with suppress(_Overtaken):
                    self._show(wishes)
            finally:
                self._is_still.set()

    def _show(self, wishes: _Wishes) -> None:
        """Go where it is wanted and draw what is seen there."""
        here, there, before = self._here, self._there, self._shown
        assert here is not None
        time_s = wishes.time_s
        if time_s is None:
            if before is None:
                return
            time_s = before.here.sample.time_s
        self._turn(wishes)
        begun = time.monotonic()
        shares = 1 if there is None else 2
        done = 0

        def report(share: float) -> None:
            if self._stopped.is_set():
                raise _Stopped
            if time.monotonic() < begun + LONG_S:
                # even who scrubs without a rest sees something
                return
            if self._wishes.jump != wishes.jump:
                raise _Overtaken
            # one who waits has the processor
            self._is_still.clear()
            self._hear(Seeking((done + share) / shares))

        first = here.moment(time_s, self._free, report)
        other = None
        if there is not None:
            done = 1
            to_s = self._maps[wishes.by_landmarks].at(time_s)
            other = there.moment(to_s, self._free, report)
        pointer = None
        if self._free is None and here.patient.hazards is not None:
            pointer = hazard_pointer(first.view, here.patient.hazards)
        self._shown = ShownReplay(
            first,
            wishes.jump,
            self._free is not None,
            other,
            first.tissue_changed,
            pointer,
        )
        self._hear(self._shown)
        self._is_first_shown.set()

    def _turn(self, wishes: _Wishes) -> None:
        """Leave the recorded view, come back to it, or look elsewhere."""
        if not wishes.is_free:
            self._free = None
            return
        if self._free is None:
            if self._shown is None:
                return
            self._free = FreeCamera(self._shown.here.view.camera.frame)
        if wishes.move is not None:
            assert self._here is not None
            distance = self._here.timeline.patient.surface.distance
            self._free = self._free.moved(wishes.move, distance)

    def _keep(self) -> None:
        here, shown = self._here, self._shown
        assert here is not None
        self._kept += 1
        time_s = 0.0 if shown is None else shown.here.sample.time_s
        name = f"own-view-{time_s:.2f}-{self._kept}" if self._free else ""
        moment = here.selected(name)
        if moment is None:
            return
        if self._queue is None:
            info, patient = here.timeline.recording.info, here.timeline.patient
            requests = SnapshotRequestFactory(
                patient.surface,
                here.scenario.scope.ring_radius_mm,
                info.seed,
                has_instrument=info.has_instrument or info.operated,
            )
            folder = self.order.folder / "snapshots"
            self._queue = SnapshotQueue(requests, folder, self._hear)
        self._queue.draw(moment)
        self._hear(
            Told(f"The moment at {time_s:.1f} s", "It is being drawn at high quality.")
        )

    def _write(self, wishes: _Wishes) -> None:
        for at_s, text in wishes.notes:
            self._change_notes(at_s, text)
        for number in wishes.removed:
            self._change_notes(number)

    def _change_notes(self, at: float, text: str = "") -> None:
        """Write a note, or remove the one of a number where there is no text."""
        folder = self.order.folder
        try:
            notes = add_note(folder, at, text) if text else remove_note(folder, int(at))
        except (UserError, OSError) as error:
            self._hear(Told("The notes stay as they are", str(error)))
        else:
            self._hear(NotesChanged(notes))

    # what follows is called by the thread that measures

    def _measure(self) -> None:
        """Step the session through its head once more, beside the pictures."""
        self._is_first_shown.wait()
        here, there = self._here, self._there
        assert here is not None
        try:
            if self._stopped.is_set():
                return
            self._hear(HeadLoaded(here.timeline.patient))
            beside = None
            if there is not None and there.patient is here.patient:
                beside = self.order.beside
            found = gather(
                self.order.folder,
                here.scenario,
                here.timeline.recording,
                here.patient,
                compare=beside,
                settings=Settings(),
                progress=self._measuring,
                keyframes=here.timeline.keyframes,
            )
            recorded = recorded_marks(here.timeline.recording.records)
            marks = measured_marks(recorded, events_of(found))
            others: list[tuple[Metric, Metric]] = []
            if beside is not None and found.compared is not None:
                others = found.compared.rows
            self._hear(Measured(marks, metric_rows(found.metrics.metrics, others)))
        except _Stopped:
            return
        except Exception as error:
            # the replay is worth more than its figures
            if not self._stopped.is_set():
                self._hear(Unmeasured(str(error) or type(error).__name__))

    def _measuring(self, stage: str, share: float) -> None:
        self._is_still.wait()
        if self._stopped.is_set():
            raise _Stopped
        assert self._here is not None
        self._hear(Near(self._here.timeline.keyframes.until_s))
        self._hear(Measuring(stage, share))


def metric_rows(
    metrics: list[Metric], paired: list[tuple[Metric, Metric]]
) -> list[Row]:
    """Return what is told of metrics: name, value, and the other session's value.

    paired: metrics and those of the other session. What a session has nothing to tell
    of is left out.
    """
    others = {(own.role, own.name): metric_text(other) for own, other in paired}
    return [
        (
            f"{metric.role}: {metric.name}",
            metric_text(metric),
            others.get((metric.role, metric.name), ""),
        )
        for metric in metrics
        if not says_nothing(metric)
    ]
