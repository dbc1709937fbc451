"""A flight that a window watches: it runs in a thread of its own.

Everything slow happens here (head, renderers, arm, registration, frames), so that the
window answers at any time.
"""

import threading
import time
from collections import deque
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from app.window.background_work import words_for
from app.window.session_thread import (
    FrameReady,
    HeadModelled,
    SessionThread,
    SlicesReady,
)
from paravol.feedback import NO_SIGNS, Feedback, SoundPlayer, TouchSigns
from paravol.feedback.hazard_pointer import HazardPointer, hazard_pointer
from paravol.flight import flight_events as events
from paravol.flight.flight import Flight, FlightOrder
from paravol.flight.flight_events import FlightEnd, FlightEvent
from paravol.flight.flight_loop import FrameEvent
from paravol.guide import Guide, GuideMark, NameMark, names_in_view
from paravol.guide.goals import GuidedHead
from paravol.guide.scope_place import ScopePlaces, ScopePose
from paravol.inputs.asked_tissue import spared_by
from paravol.inputs.hand import limits_about, nostril_fulcrum
from paravol.patient import PatientScene
from paravol.slices.cutaway import cutter
from paravol.snapshots.moments import SnapshotRequestFactory
from paravol.snapshots.snapshot_queue import (
    MomentPicture,
    SelectedMoment,
    SnapshotQueue,
)
from renderers.scene import Volume
from scenarios import FrameState, InstrumentState, Sample
from scenarios.instrument_state import EMPTY_HAND
from scenarios.tasks import TaskState
from system import UserError

if TYPE_CHECKING:
    from app.vtk.head_model import HeadModel

RATE_OVER_S = 1.0
"""The frame rate is that of the last second."""


@dataclass(frozen=True, slots=True)
class DisplayedFrame:
    """What the window shows of one frame; pixels ``(h, w, 3)`` uint8 sRGB.

    cuts, signs, tasks: see `FrameEvent`. tool: what the second hand does. pointer:
    where the nearest hazard lies. is_frozen: the trainer was. stood_s: so long the
    score's clock has stood. guide: where to go. names: of what is seen, when asked for.
    """

    pixels: NDArray[np.uint8]
    view: FrameState
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


@dataclass(frozen=True, slots=True)
class HeadUnseen:
    """There is no head for the overview."""

    why: str


@dataclass(frozen=True, slots=True)
class SoundFailed:
    """There is no sound."""

    why: str


@dataclass(frozen=True, slots=True)
class ScopeLaid:
    """The assistant has looked for a place for the scope.

    other: name of a tool that has one where this one has not, "" for none.
    """

    is_found: bool
    other: str


@dataclass(frozen=True, slots=True)
class ThreadEnding:
    """The thread is about to end; see `FlightThread.error`."""


WindowEvent = (
    FlightEvent
    | HeadModelled
    | HeadUnseen
    | SlicesReady
    | FrameReady
    | MomentPicture
    | SoundFailed
    | ScopeLaid
    | FlightEnd
    | ThreadEnding
)
"""What a window hears of a flight. `MomentPicture`: a kept moment's snapshot, as far
as it is drawn. `FlightEnd`: the path's end was reached or the trainee ended it."""


class FlightThread(SessionThread[DisplayedFrame]):
    """Run one flight in a thread and report each `WindowEvent` to a window."""

    def __init__(
        self, order: FlightOrder, *, has_sound: bool = False, volume: float = 1.0
    ) -> None:
        """Prepare a flight; has_sound: whether the sound is on. volume: 0 to 1."""
        super().__init__()
        self.error: Exception | None = None
        self.sound = SoundPlayer(
            is_on=has_sound,
            volume=volume,
            told=lambda why: self.told.emit(SoundFailed(why)),
        )
        self._feedback = Feedback(self.sound, order.input.rumble)
        self.flight = Flight(order, self.hear)
        self.guide = Guide(order.scenario.tasks)
        self.names_at: tuple[float, float] | None = None
        """Place in the picture, in shares, while what is seen is named; else None."""
        self._queue: SnapshotQueue | None = None
        self._patient: PatientScene | None = None
        self.last: DisplayedFrame | None = None
        """The last frame, None before the first."""
        self._before: Sample | None = None
        self._stood_s = 0.0
        self._is_laid = False
        self._frame_times: deque[float] = deque()
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

    def _run(self) -> None:
        try:
            flown = self.flight.run()
            if flown is not None:
                self.told.emit(self.flight.result)
        except Exception as error:
            # An exception of a thread is lost; the window raises this one.
            self.error = error
        self._feedback.quiet()
        with suppress(RuntimeError):
            # a program that ended without it has no window any more
            self.told.emit(ThreadEnding())

    def hear(self, event: FlightEvent) -> None:
        """Do what an event asks for, and pass it on to the window."""
        match event:
            case FrameEvent():
                self._keep_frame(event)
            case events.Progressed(stage, share):
                self._tell_news(events.Progressed(stage, round(share, 2)))
            case events.Touching(stage, share):
                self._begin_model()
                count = len(self.flight.order.scenario.fiducials) or 1
                self._tell_news(events.Touching(stage, round(share * count) / count))
            case events.HeadLoaded(patient):
                self._patient = patient
                self.told.emit(SlicesReady(patient.slice_views()))
            case _:
                self.told.emit(event)
        match event:
            case events.RecordingBegan():
                self._begin_guide()
                self._begin_snapshots()
            case events.MomentKept(frame):
                self._draw_moment(frame)
            case events.DeviceLost():
                # what is not live is neither heard nor felt
                self._feedback.quiet()

    def _begin_model(self) -> None:
        """Have the overview's head made, unless it was begun."""
        if self._modeller.ident is None:
            self._modeller.start()

    def _model_head(self) -> None:
        """Give the overview its head; what goes wrong is told."""
        try:
            self.told.emit(HeadModelled(self._made_head()))
        except Exception as error:
            self.told.emit(HeadUnseen(words_for(error)))

    def _made_head(self) -> "HeadModel":
        """Build what the overview shows of the head, beside touching and flying.

        The first picture does not wait for it.
        """
        from app.vtk.head_model import session_head

        patient, flight = self._patient, self.flight
        assert patient is not None
        assert flight.path is not None
        cut_open = cutter(patient, flight.path)
        return session_head(patient, flight.order.scenario, cut_open)

    def _begin_snapshots(self) -> None:
        """Prepare to draw kept moments, where they can be kept."""
        folder, order = self.flight.recording.folder, self.flight.order
        if folder is None or self._patient is None:
            return
        requests = SnapshotRequestFactory(
            self._patient.surface,
            order.scenario.scope.ring_radius_mm,
            self._patient.detail_seed,
            has_instrument=True,
        )
        # It goes on after the flight, as long as the window.
        self._queue = SnapshotQueue(requests, folder / "snapshots", self.told.emit)

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

        `ScopeLaid` tells. Return whether anything is done with that tool.
        """

        def lay(pose: ScopePose | None, drawn_mm: float, other: str) -> None:
            if pose is not None:
                self.flight.note_aid("assistant lays the scope")
                self.flight.order.input.lay(pose.frame, pose.entry_mm, drawn_mm)
            self.told.emit(ScopeLaid(pose is not None, other))

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

    def _names(self, view: FrameState) -> tuple[NameMark, ...]:
        at, patient = self.names_at, self._patient
        if at is None or patient is None:
            return ()
        head = patient.landmarks, patient.structures
        return names_in_view(view.camera, self._air(patient), *head, at)

    def _draw_moment(self, event: FrameEvent) -> None:
        """Have the moment drawn at high quality."""
        if self._queue is not None:
            time_s = event.sample.time_s
            moment = SelectedMoment(
                time_s,
                event.view,
                event.frame.gain,
                event.number,
                event.tissue,
                event.frame.lens,
                event.frame.pixels,
            )
            # it has its place in the strip while others are drawn
            self.told.emit(MomentPicture(time_s, None, 0.0))
            self._queue.draw(moment)

    def _keep_frame(self, event: FrameEvent) -> None:
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
        self.last = displayed
        self._keep(displayed)
        self._begin_model()

    def _stood(self, sample: Sample) -> float:
        """Return how long the score's clock has stood, s."""
        before, self._before = self._before, sample
        if before is not None and (before.is_frozen or sample.is_frozen):
            self._stood_s += sample.time_s - before.time_s
        return self._stood_s

    def _pointer(self, view: FrameState) -> HazardPointer | None:
        """Return where the nearest hazard lies, where hazards are known."""
        patient = self._patient
        if patient is None or patient.hazards is None:
            return None
        return hazard_pointer(view, patient.hazards)
