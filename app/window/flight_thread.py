"""A flight that a window watches: it runs in a thread of its own.

Everything slow happens here (head, renderers, arm, registration, frames), so that the
window answers at any time. What happens is told by signals, which Qt delivers in the
window's thread; of the frames only the newest is kept for it.
"""

import threading
import time
from collections import deque
from contextlib import ExitStack
from dataclasses import asdict
from functools import partial
from pathlib import Path

from PySide6.QtCore import QObject, Signal

from app.errors import DeviceLostError
from app.vtk.head_model import head_model
from devices import DeviceError, Registration
from devices.controls.pedals import Button, ButtonEvent
from paravol.cutaway import cutter
from paravol.device_log import DeviceLog
from paravol.flight import Aim, EndedError, OrderedPoses, Shown, fly
from paravol.flight_end import FlightEnd
from paravol.flight_order import FlightOrder, Instant
from paravol.flight_recording import FlightRecording
from paravol.inputs.cancellable_source import (
    CancellableSource,
    ClosedError,
    KeyboardRoll,
)
from paravol.inputs.pedal_watch import PedalWatch, record_of
from paravol.inputs.reconnecting_source import LastingPoses
from paravol.patient import OperatingRoom, prepare_room
from paravol.pose_stream import StreamedAim, streaming
from paravol.registration.at_start import register_by_touch
from paravol.session_info import LIVE_TIER, SEED, describe_session
from paravol.session_setup import build_session, build_view, first_views
from paravol.snapshots.moments import SnapshotRequestFactory
from paravol.snapshots.snapshot_queue import SelectedMoment, SnapshotQueue
from paravol.view import EndoscopeView
from paravol.view_keeper import ViewKeeper
from scenarios import Sample, Session
from scenarios.bundle import EventRecord, SessionRecorder

RATE_OVER_S = 1.0
"""The frame rate is that of the last second."""


class WindowFlight(QObject):
    """Run one flight in a thread; tell a window about it."""

    staged = Signal(str, float)
    """A preparation and its done share, 0 to 1."""
    head_ready = Signal(object)
    """A `HeadModel`."""
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
    away = Signal()
    """The device was unplugged; it is being looked for."""
    back = Signal(float)
    """It is there again, after so many seconds."""
    landed = Signal(object)
    """The flight is over: the path's end was reached or the trainee ended it; the
    `FlightEnd`."""
    finished = Signal()
    """The thread is about to end; see `error`."""

    def __init__(self, order: FlightOrder) -> None:
        super().__init__()
        self.error: Exception | None = None
        self.end: FlightEnd | None = None
        self.order = order
        self.recording = FlightRecording(order)
        self.roll = KeyboardRoll(order.input.aim)
        self._closed = threading.Event()
        self._ended = threading.Event()
        self._moment_wanted = threading.Event()
        self._view_wanted = threading.Event()
        self._snapshots: SnapshotQueue | None = None
        self._lock = threading.Lock()
        self._newest: Instant | None = None
        self._touched = -1
        self._told = ("", 0.0)
        # A daemon: a kernel that is just being compiled must not keep the program.
        self._thread = threading.Thread(target=self._run, name="flight", daemon=True)

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    def end_flight(self) -> None:
        """End the flight as if its path were flown; the result is told."""
        self._ended.set()

    def stop(self, patience_s: float) -> bool:
        """End the flight; tell whether its thread ended in time."""
        self._closed.set()
        self._thread.join(patience_s)
        if self._snapshots is not None:
            self._snapshots.close()
        return not self._thread.is_alive()

    def take(self) -> Instant | None:
        """Take the newest frame; None when it was taken before."""
        with self._lock:
            newest, self._newest = self._newest, None
        return newest

    def keep_moment(self) -> None:
        """Ask for a snapshot of the next frame's moment."""
        self._moment_wanted.set()

    def keep_view(self) -> None:
        """Ask for the next frame's view as a file."""
        self._view_wanted.set()

    def _run(self) -> None:
        try:
            self._fly()
        except EndedError:
            pass
        except Exception as error:
            # Nobody sees what a thread raises; whoever started the flight does.
            self.error = error
        self.finished.emit()

    def _stage(self, stage: str, share: float) -> None:
        if self._closed.is_set():
            raise ClosedError
        # Some stages report every step of thousands.
        told = stage, round(share, 2)
        if told != self._told:
            self._told = told
            self.staged.emit(*told)

    def _touch(self, stage: str, share: float) -> None:
        touched = round(share * len(self.order.scenario.fiducials))
        # Progress is told with every pose, a hundred times a second.
        if touched != self._touched:
            self._touched = touched
            self.touching.emit(touched)

    def _fly(self) -> None:
        order, scenario = self.order, self.order.scenario
        room = prepare_room(scenario, self._stage)
        targets = room.positions(scenario.targets)
        self.slices_ready.emit(room.slice_views())
        cut_open = cutter(room, order.path)
        face = None if room.face is None else room.face()
        self.head_ready.emit(head_model(room.surface, targets, cut_open, face))
        size = (order.size, order.size)
        has_instrument = order.input.has_instrument
        view = build_view(
            scenario,
            room,
            tier=LIVE_TIER,
            seed=SEED,
            has_instrument=has_instrument,
            threads=order.threads,
            progress=self._stage,
        )
        view.warm_up(first_views(scenario, room, order.path, size), self._stage)
        self._stage("Opening the input", 0.0)
        with ExitStack() as stack:
            streamer = stack.enter_context(streaming(order.stream))
            poses = stack.enter_context(order.input.open(room))
            self._stage("Opening the input", 1.0)
            source = CancellableSource(poses, self._closed, self._ended)
            lasting = LastingPoses(source)
            lasting.on_loss = lambda _: self.away.emit()
            lasting.on_return = self.back.emit
            registration, told = self._register(lasting)
            order.input.placed(registration)
            info = describe_session(
                scenario,
                room,
                registration,
                size=order.size,
                has_instrument=has_instrument,
            )
            world_from_device = registration.world_from_device
            session = build_session(scenario, room, world_from_device, size)
            recorder = self.recording.open(stack, info)
            self.registered.emit(told)
            if self.recording.folder is not None:
                self._snapshots = self._open_snapshots(room, self.recording.folder)
            keeper = ViewKeeper(
                scenario, room, order.record, has_instrument=has_instrument
            )
            aim: Aim = PedalWatch(self.roll, partial(self._on_pedal, recorder))
            if streamer is not None:
                aim = StreamedAim(aim, streamer, world_from_device, has_instrument)
            self._follow(source, lasting, aim, session, view, recorder, keeper)

    def _register(self, source: OrderedPoses) -> tuple[Registration, float | None]:
        """Ask for the fiducials to be touched, unless the input lies in the patient.

        With the residual in mm rms, where it was measured.
        """
        known = self.order.input.registration
        if known is not None:
            return known, None
        fiducials = self.order.scenario.fiducial_positions()
        registration = register_by_touch(source, fiducials, self._touch)
        return registration, registration.residual_rms_mm

    def _on_pedal(
        self, recorder: SessionRecorder, event: ButtonEvent, sample: Sample
    ) -> None:
        """Record a pedal; the right one keeps the moment, as the space bar does."""
        if sample.time_s < 0.0:
            return
        recorder.add(record_of(event, sample.time_s))
        if event.is_down and event.button == Button.RIGHT_PEDAL:
            self._moment_wanted.set()

    def _follow(
        self,
        source: CancellableSource,
        lasting: LastingPoses,
        aim: Aim,
        session: Session,
        view: EndoscopeView,
        recorder: SessionRecorder,
        keeper: ViewKeeper,
    ) -> None:
        """Fly until the path ends, the window closes or the arm is lost for good."""
        order = self.order
        shown: deque[float] = deque()
        log = DeviceLog(recorder, session)

        def on_loss(loss: DeviceError) -> None:
            log.lost(loss)
            self.away.emit()

        def on_return(away_s: float) -> None:
            log.returned(away_s)
            self.back.emit(away_s)

        lasting.on_loss, lasting.on_return = on_loss, on_return

        def on_frame(frame: Shown) -> None:
            now = time.monotonic()
            shown.append(now)
            while shown[0] < now - RATE_OVER_S:
                shown.popleft()
            rate = (len(shown) - 1) / max(now - shown[0], 1e-3)
            time_s, gain = frame.sample.time_s, frame.frame.gain
            if self._moment_wanted.is_set():
                self._moment_wanted.clear()
                said = f"frame {frame.number}"
                recorder.add(EventRecord(time_s, "snapshot", said))
                self.moment_kept.emit(time_s)
                if self._snapshots is not None:
                    self._snapshots.draw(
                        SelectedMoment(time_s, frame.view, gain, frame.number)
                    )
            if self._view_wanted.is_set():
                self._view_wanted.clear()
                kept = keeper.keep(frame.view, frame.frame, frame.sample, frame.number)
                self.view_kept.emit(*kept)
            pixels = frame.frame.pixels
            self._post(Instant(pixels, frame.view, time_s, frame.pose_age_ms, rate))

        try:
            timing = fly(
                lasting,
                aim,
                session,
                view,
                recorder,
                until_s=order.input.until_s,
                on_frame=on_frame,
            )
        except (DeviceError, TimeoutError) as error:
            log.lost(error)
            if recorder.samples:
                lost = "The arm was lost"
                self.end = self.recording.end(lost, session.score())
            if self.recording.folder is None:
                raise
            raise DeviceLostError(error, self.recording.folder) from error
        if not recorder.samples:
            return
        score = session.score()
        recorder.close({"score": asdict(score), "timing": timing.figures()})
        is_flown = not (self._ended.is_set() or self._closed.is_set())
        title = "The path is flown" if is_flown else "The flight is over"
        self.end = self.recording.end(title, score)
        self.landed.emit(self.end)

    def _open_snapshots(self, room: OperatingRoom, record: Path) -> SnapshotQueue:
        """Draw kept moments; that goes on after the flight, as long as the window."""
        # Imported here: building meshes loads a large library.
        from scenarios.instruments import suction_tube

        requests = SnapshotRequestFactory(
            room.surface,
            self.order.scenario.scope.ring_radius_mm,
            SEED,
            suction_tube() if self.order.input.has_instrument else None,
        )
        return SnapshotQueue(requests, record / "snapshots", self.pictured.emit)

    def _post(self, instant: Instant) -> None:
        with self._lock:
            was_taken = self._newest is None
            self._newest = instant
        if was_taken:
            self.arrived.emit()
