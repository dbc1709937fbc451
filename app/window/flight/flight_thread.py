"""A flight that a window watches: it runs in a thread of its own.

Everything slow happens here (head, renderers, arm, registration, frames), so that the
window answers at any time. Events are signals, which Qt delivers in the window's
thread; of the frames only the newest is kept for it.
"""

import threading
import time
from collections import deque
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject, Signal

from app.window.background_work import words_for
from devices import DeviceError
from disk import UserError
from paravol.cutaway import cutter
from paravol.feedback import NO_SIGNS, Feedback, SoundPlayer, TouchSigns
from paravol.feedback.hazard_pointer import HazardPointer, hazard_pointer
from paravol.flight import Flight, FlightObserver, FlightOrder
from paravol.flight_loop import FrameEvent
from paravol.flight_observers import FlightObservers
from paravol.guide import Guide, GuideMark, NameMark, names_in_view
from paravol.guide.goals import GuidedHead
from paravol.guide.scope_place import ScopePlaces, ScopePose
from paravol.inputs.asked_tissue import spared_by
from paravol.inputs.hand import limits_about, nostril_fulcrum
from paravol.patient import PatientScene
from paravol.session_setup import SEED
from paravol.snapshots.moments import SnapshotRequestFactory
from paravol.snapshots.snapshot_queue import (
    MomentPicture,
    SelectedMoment,
    SnapshotQueue,
)
from renderers.scene import Volume
from scenarios import InstrumentState, Sample, View
from scenarios.instrument_state import EMPTY_HAND
from scenarios.tasks import Status, TaskEvent, TaskState

if TYPE_CHECKING:
    from app.vtk.head_model import HeadModel

RATE_OVER_S = 1.0
"""The frame rate is that of the last second."""


@dataclass(frozen=True, slots=True)
class DisplayedFrame:
    """Hold what the window shows of one frame; pixels ``(h, w, 3)`` uint8 sRGB.

    cuts, signs, tasks: see `FrameEvent`. tool: what the second hand does. pointer:
    where the nearest hazard lies. is_frozen: the trainer was. stood_s: so long the
    score's clock has stood. guide: where to go. names: of what is seen, when asked for.
    """

    pixels: NDArray[np.uint8]
    view: View
    time_s: float
    pose_age_ms: float
    fps: float
    cuts: int = 0
    tool: InstrumentState = EMPTY_HAND
    signs: TouchSigns = NO_SIGNS
    pointer: HazardPointer | None = None
    tasks: tuple[TaskState, ...] = ()
    is_frozen: bool = False
    stood_s: float = 0.0
    guide: GuideMark | None = None
    names: tuple[NameMark, ...] = ()


class FlightThread(QObject, FlightObserver):
    """Run one flight in a thread and report to a window."""

    staged = Signal(str, float)
    """A preparation and its done share, 0 to 1."""
    head_ready = Signal(object)
    """A `HeadModel`."""
    unseen = Signal(str)
    """There is no head for the overview, and why."""
    slices_ready = Signal(object)
    """`SliceViews` of the head."""
    touching = Signal(int)
    """Number of fiducials touched so far; the next one is wanted."""
    registered = Signal(object)
    """The recording begins; residual in mm rms, None when nothing had to be touched."""
    arrived = Signal()
    """There is a new frame: `take` it."""
    moment_kept = Signal(float)
    """A snapshot of this time of the session was asked for."""
    pictured = Signal(object)
    """A `MomentPicture`: a kept moment's snapshot, as far as it is drawn."""
    view_kept = Signal(str, str)
    """A view was saved as a file, or not: what to say of it, and where it is or why."""
    injured = Signal(str)
    """Something was hurt that must not be: what, and through what."""
    tool_device = Signal(str)
    """The tool's device was lost, or is back: what to say of it."""
    unrecorded = Signal(str)
    """Nothing more is recorded, and why."""
    unheard = Signal(str)
    """There is no sound, and why."""
    task_ended = Signal(str, bool, str)
    """A task was done (True) or failed: its name, and what to say of it."""
    away = Signal()
    """The device was unplugged; it is being looked for."""
    back = Signal(float)
    """It is there again; the seconds it was away."""
    late = Signal(str)
    """The flight stood still: how long, and what was left out by that."""
    laid = Signal(bool, str)
    """The assistant has looked: whether there is a place for the scope, and else the
    name of a tool that has one, "" for none."""
    landed = Signal(object)
    """The flight is over: the path's end was reached or the trainee ended it; the
    `FlightEnd`."""
    finished = Signal()
    """The thread is about to end; see `error`."""

    def __init__(
        self, order: FlightOrder, *, has_sound: bool = False, volume: float = 1.0
    ) -> None:
        """Prepare a flight; has_sound: whether the sound is on. volume: 0 to 1."""
        super().__init__()
        self.error: Exception | None = None
        self.sound = SoundPlayer(is_on=has_sound, volume=volume, told=self.unheard.emit)
        self._feedback = Feedback(self.sound, order.input.rumble)
        self.flight = Flight(order, FlightObservers(self, *order.watchers))
        self.guide = Guide(order.scenario.tasks)
        self.names_at: tuple[float, float] | None = None
        """Place in the picture, in shares, while what is seen is named; else None."""
        self._queue: SnapshotQueue | None = None
        self._patient: PatientScene | None = None
        self._lock = threading.Lock()
        self._newest: DisplayedFrame | None = None
        self.last: DisplayedFrame | None = None
        """The last frame, None before the first."""
        self._before: Sample | None = None
        self._stood_s = 0.0
        self._is_laid = False
        self._frame_times: deque[float] = deque()
        self._touched = -1
        self._staged = ("", 0.0)
        # A daemon: a kernel that is just being compiled must not keep the program.
        self._thread = threading.Thread(target=self._run, name="flight", daemon=True)
        self._modeller = threading.Thread(
            target=self._model_head, name="head model", daemon=True
        )

    def start(self) -> None:
        """Begin."""
        self.sound.start()
        self._thread.start()

    def stop(self, patience_s: float) -> bool:
        """End the flight, if it began; return whether its threads ended in time."""
        self.flight.cancel()
        # who hears of a place for the scope may be gone before the threads are
        self.guide.close()
        begun = [t for t in (self._thread, self._modeller) if t.ident is not None]
        for thread in begun:
            thread.join(patience_s)
        self._feedback.close()
        if self._queue is not None:
            self._queue.close()
        return not any(thread.is_alive() for thread in begun)

    def take(self) -> DisplayedFrame | None:
        """Take the newest frame; None when it was taken before."""
        with self._lock:
            newest, self._newest = self._newest, None
        return newest

    def _run(self) -> None:
        try:
            flown = self.flight.run()
            if flown is not None:
                self.landed.emit(self.flight.result)
        except Exception as error:
            # An exception of a thread is lost; the window raises this one.
            self.error = error
        self._feedback.quiet()
        with suppress(RuntimeError):
            # a program that ended without it has no window any more
            self.finished.emit()

    def on_progress(self, stage: str, share: float) -> None:
        """Report a stage; some report every step of thousands."""
        staged = stage, round(share, 2)
        if staged != self._staged:
            self._staged = staged
            self.staged.emit(*staged)

    def on_patient(self, patient: PatientScene) -> None:
        """Give the slices the head."""
        self._patient = patient
        self.slices_ready.emit(patient.slice_views())

    def _begin_model(self) -> None:
        """Have the overview's head made, unless it was begun."""
        if self._modeller.ident is None:
            self._modeller.start()

    def _model_head(self) -> None:
        """Give the overview its head; what goes wrong is told."""
        try:
            self.head_ready.emit(self._made_head())
        except Exception as error:
            self.unseen.emit(words_for(error))

    def _made_head(self) -> "HeadModel":
        """Build what the overview shows of the head, beside touching and flying.

        The first picture does not wait for it.
        """
        from app.vtk.head_model import COARSENESS, FINE, head_model

        patient, order = self._patient, self.flight.order
        assert patient is not None
        assert self.flight.path is not None
        targets = patient.positions(order.scenario.targets)
        cut_open = cutter(patient, self.flight.path)
        face = None if patient.face is None else patient.face()
        coarseness = FINE if order.scenario.head.scene else COARSENESS
        return head_model(patient.surface, targets, cut_open, face, coarseness)

    def on_touch(self, stage: str, share: float) -> None:
        """Report each fiducial once."""
        self._begin_model()
        touched = round(share * len(self.flight.order.scenario.fiducials))
        if touched != self._touched:
            self._touched = touched
            self.touching.emit(touched)

    def on_start(self, residual_mm: float | None) -> None:
        """Report the start; prepare to draw kept moments, where they can be kept."""
        self.registered.emit(residual_mm)
        self._begin_guide()
        folder, order = self.flight.recording.folder, self.flight.order
        if folder is None or self._patient is None:
            return
        requests = SnapshotRequestFactory(
            self._patient.surface,
            order.scenario.scope.ring_radius_mm,
            SEED,
            has_instrument=True,
        )
        # It goes on after the flight, as long as the window.
        self._queue = SnapshotQueue(requests, folder / "snapshots", self.pictured.emit)

    def guide_by(self, is_on: bool) -> None:
        """Show the way, or hide it; the recording tells of it."""
        self.guide.is_on = is_on
        self.flight.note_aid(f"guide {'on' if is_on else 'off'}")

    def _begin_guide(self) -> None:
        patient, flight = self._patient, self.flight
        if patient is None or not flight.order.scenario.tasks:
            return
        assert flight.path is not None
        session = flight.session
        self.guide.take_head(
            GuidedHead(
                self._air(patient),
                patient.landmarks,
                patient.structures,
                None if session is None else session.coverage,
                self._pivot_mm(patient),
                patient.hazards,
                spared_by(flight.order.scenario.tasks),
                None if flight.hand.pointed is None else flight.hand.pointed.plan,
                flight.order.scenario.scope.endoscope().diameter_mm / 2,
            ),
            self._scopes(patient),
        )
        self.guide_by(self.guide.is_on)

    def _scopes(self, patient: PatientScene) -> ScopePlaces | None:
        """Return what finds a place for the scope; None where a hand holds it."""
        order = self.flight.order
        if not order.input.can_lay or patient.face is None:
            return None
        fulcrum = nostril_fulcrum(patient, self.flight.path, order.scenario.start)
        endoscope = order.scenario.scope.endoscope()
        cone_deg = limits_about(fulcrum).cone_deg
        return ScopePlaces(
            fulcrum, self._air(patient), endoscope, cone_deg, patient.hazards
        )

    def lay_scope(self, frame: DisplayedFrame) -> bool:
        """Let an assistant lay the scope where the tool in hand gets to its place.

        `laid` tells. Return whether anything is done with that tool.
        """

        def lay(pose: ScopePose | None, drawn_mm: float, other: str) -> None:
            if pose is not None:
                self.flight.note_aid("assistant lays the scope")
                self.flight.order.input.lay(pose.frame, pose.entry_mm, drawn_mm)
            self.laid.emit(pose is not None, other)

        return self.guide.lay_scope(
            frame.view, frame.tasks, frame.cuts, self.flight.hand.tools, lay
        )

    def _pivot_mm(self, patient: PatientScene) -> NDArray[np.float64]:
        """Return what the scope's shaft turns about."""
        flight = self.flight
        assert flight.path is not None
        try:
            start = flight.order.scenario.start
            return nostril_fulcrum(patient, flight.path, start).pivot_mm
        except UserError:
            # a head without a known nostril: where the scope begins
            place: NDArray[np.float64] = flight.path.tip_mm[0]
            return place

    @staticmethod
    def _air(patient: PatientScene) -> Volume:
        """Return the air's distance as it is cut; not bent by tools, where known."""
        named = patient.structures
        return patient.surface.distance if named is None else named.distance

    def _names(self, view: View) -> tuple[NameMark, ...]:
        at, patient = self.names_at, self._patient
        if at is None or patient is None:
            return ()
        head = patient.landmarks, patient.structures
        return names_in_view(view.camera, self._air(patient), *head, at)

    def on_moment(self, event: FrameEvent) -> None:
        """Have the moment drawn at high quality."""
        time_s, gain = event.sample.time_s, event.frame.gain
        self.moment_kept.emit(time_s)
        if self._queue is not None:
            moment = SelectedMoment(
                time_s,
                event.view,
                gain,
                event.number,
                event.tissue,
                event.frame.lens,
                event.frame.pixels,
            )
            # it has its place in the strip while others are drawn
            self.pictured.emit(MomentPicture(time_s, None, 0.0))
            self._queue.draw(moment)

    def on_view_saved(self, message: str, where: str) -> None:
        """Tell the window."""
        self.view_kept.emit(message, where)

    def on_injury(self, text: str) -> None:
        """Tell the window."""
        self.injured.emit(text)

    def on_task(self, event: TaskEvent) -> None:
        """Tell the window of what is done or failed."""
        if event.status in (Status.DONE, Status.FAILED):
            is_done = event.status is Status.DONE
            self.task_ended.emit(event.task, is_done, event.text)

    def on_tool_device(self, text: str) -> None:
        """Tell the window."""
        self.tool_device.emit(text)

    def on_unrecorded(self, problem: str) -> None:
        """Tell the window."""
        self.unrecorded.emit(problem)

    def on_loss(self, loss: DeviceError) -> None:
        """Tell the window; what is not live is neither heard nor felt."""
        self._feedback.quiet()
        self.away.emit()

    def on_return(self, away_s: float) -> None:
        """Tell the window."""
        self.back.emit(away_s)

    def on_late(self, text: str) -> None:
        """Tell the window."""
        self.late.emit(text)

    def on_frame(self, event: FrameEvent) -> None:
        """Keep the frame for the window, with the frame rate of the last second."""
        was_laid, self._is_laid = self._is_laid, self.flight.order.input.is_laid
        if was_laid and not self._is_laid:
            self.guide.look_anew()
        now = time.monotonic()
        times = self._frame_times
        times.append(now)
        while times[0] < now - RATE_OVER_S:
            times.popleft()
        displayed = DisplayedFrame(
            event.frame.pixels,
            event.view,
            event.sample.time_s,
            event.pose_age_ms,
            fps=(len(times) - 1) / max(now - times[0], 1e-3),
            cuts=event.cuts,
            tool=event.sample.instrument,
            signs=event.signs,
            pointer=self._pointer(event.view),
            tasks=event.tasks,
            is_frozen=event.sample.is_frozen,
            stood_s=self._stood(event.sample),
            guide=self.guide.mark(event.view, event.tasks, event.cuts),
            names=self._names(event.view),
        )
        if event.sample.is_frozen:
            self._feedback.quiet()
        else:
            self._feedback.follow(event.signs)
        with self._lock:
            was_taken = self._newest is None
            self._newest = self.last = displayed
        if was_taken:
            self.arrived.emit()
        self._begin_model()

    def _stood(self, sample: Sample) -> float:
        """Return how long the score's clock has stood, s."""
        before, self._before = self._before, sample
        if before is not None and (before.is_frozen or sample.is_frozen):
            self._stood_s += sample.time_s - before.time_s
        return self._stood_s

    def _pointer(self, view: View) -> HazardPointer | None:
        """Return where the nearest hazard lies, where hazards are known."""
        patient = self._patient
        if patient is None or patient.hazards is None:
            return None
        return hazard_pointer(view, patient.hazards)
