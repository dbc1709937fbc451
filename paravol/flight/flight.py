"""One flight: open the patient and the input, register, fly, close the recording.

The demonstration and the trainee's window fly by the same `Flight`; what they do with
it, they do as they hear of its `FlightEvent`s.
"""

import math
import shutil
import tempfile
import threading
from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, suppress
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path

import msgspec
import numpy as np

from devices import DeviceError, ProbePath, Registration
from devices.controls.pedals import Button, ButtonEvent
from paravol.exercises.exercise_fit import check_fit
from paravol.exercises.exercise_path import start_path
from paravol.flight import flight_events as events
from paravol.flight.flight_events import FlightEnd, FlightEvent, Hear
from paravol.flight.flight_loop import FrameEvent, FramePacing, Listeners, Timing, fly
from paravol.flight.operation_rehearsal import Rehearsal, rehearse
from paravol.flight.picture_size import PictureSize
from paravol.flight.pose_streaming import publish_sample, streaming
from paravol.flight.preparation import Preparation
from paravol.flight.renderer_compiler import RendererCompiler
from paravol.guide.goals import open_task
from paravol.inputs.flight_input import FlightInput
from paravol.inputs.hand import pointed_tool
from paravol.inputs.instrument_controller import InstrumentController
from paravol.inputs.instrument_input import InstrumentInput
from paravol.inputs.pose_completer import pedal_record
from paravol.inputs.pose_sources import (
    CancellableSource,
    ClosedError,
    EndedError,
    OrderedPoses,
    ReconnectingSource,
)
from paravol.inputs.reach import Reach, ReachedPoses
from paravol.inputs.scope_in_hand import ScopeInHand
from paravol.inputs.second_channel import SecondChannel
from paravol.patient import PatientScene, load_patient
from paravol.registration.at_start import register_by_touch
from paravol.sessions.keyframes import Keyframes, save_keyframes
from paravol.sessions.session_setup import (
    build_session,
    build_view,
    coverage_watch,
    describe_session,
    first_views,
    operate_on,
)
from paravol.sessions.session_store import SessionStore
from paravol.snapshots.view_file import save_view
from paravol.snapshots.view_sources import mark_of, view_of
from paravol.view import EndoscopeView
from scenarios import Sample, Scenario, Score, Session
from scenarios.bundle import EventRecord, SessionInfo, SessionRecorder
from scenarios.scenario import CameraHold
from scenarios.tasks import Task
from system import UserError

TOOL_PAUSE_S = 0.1
"""Before each tool that is made ready while the first frames are drawn."""


@dataclass(frozen=True, slots=True)
class FlightOrder:
    """Describe a flight that is to be flown.

    path: what was recorded for the exercise, None where nothing was.
    size: of the square picture, pixels. record: folder of the recording, where one was
    named. stream: host and port at which tool poses are streamed, None for no stream.
    kept: store for flights without a named folder, None to record none of them.
    patience_s: the flight ends when the device has been away for this long.
    instrument: a second device for the tool; None where the input moves it, if any.
    watchers: hear of the flight beside whoever shows it.
    follows_window: the picture is as large as `Flight.picture` is asked for, and less
    where frames would be late; `size` is then the most.
    """

    scenario: Scenario
    path: ProbePath | None
    input: FlightInput
    size: int
    threads: int
    record: Path | None
    stream: tuple[str, int] | None = None
    kept: SessionStore | None = None
    patience_s: float = math.inf
    instrument: InstrumentInput | None = None
    watchers: tuple[Hear, ...] = ()
    follows_window: bool = False

    @property
    def has_own_tool(self) -> bool:
        """Return whether the input moves the tool by itself, as a recorded path does.

        A second device takes its place.
        """
        return self.input.has_instrument and self.instrument is None


@dataclass(frozen=True, slots=True)
class FinishedFlight:
    """What a flight leaves: its parts, for reports and snapshots."""

    patient: PatientScene
    view: EndoscopeView
    info: SessionInfo
    timing: Timing
    score: Score


class DeviceLostError(UserError):
    """The device failed in flight; the recording up to then is kept."""

    def __init__(self, error: Exception, bundle: Path) -> None:
        super().__init__(
            f"{error} What was flown until then is in {bundle} and can be replayed."
        )


class Flight:
    """Fly once. `end`, `cancel` and what asks for a frame may be called by any thread.

    scope: that is in hand. hand: holds the instruments. recording: where the flight is
    recorded.
    head: as before anybody operated; None until it is there.
    picture: chooses the picture's size; None where it stays.
    path: of the scope, straight in where none was recorded; None until the head is
    there. result: how it ended; None before, and where not a single pose was flown.
    session: None until it begins.
    """

    def __init__(
        self,
        order: FlightOrder,
        hear: Hear,
        keeps_tissue: Callable[[float], bool] = lambda time_s: False,
    ) -> None:
        """Prepare a flight; hear: is told of it, before those who look on.

        keeps_tissue: returns whether the event of a frame that is not begun yet, of a
        time in s, shall hold the tissue that it shows. A few ms where much was cut.
        """
        self.order = order
        self._hearers = (hear, *order.watchers)
        self._keeps_tissue = keeps_tissue
        scope = order.scenario.scope
        self.scope = ScopeInHand(
            scope.angle_deg,
            scope.choices_deg,
            follows_post=scope.camera is CameraHold.WITH_POST,
            camera_deg=scope.camera_roll_deg,
        )
        self.hand = InstrumentController(scope.endoscope(), order.scenario.tools)
        self._channel = SecondChannel(order.input.completer, self.scope, self.hand)
        self.recording = FlightRecording(
            order, lambda why: self._tell(events.RecordingStopped(why))
        )
        self._keyframes = Keyframes()
        self.head: PatientScene | None = None
        self.picture = PictureSize(order.size) if order.follows_window else None
        self.size = order.size if self.picture is None else self.picture.first
        self.path = order.path
        self.result: FlightEnd | None = None
        self.session: Session | None = None
        self._closed = threading.Event()
        self._ended = threading.Event()
        self._moment_wanted = threading.Event()
        self._view_wanted = threading.Event()
        self._aids: deque[str] = deque()

    def end(self) -> None:
        """End the flight as if its path were flown."""
        self._ended.set()

    def cancel(self) -> None:
        """End whatever goes on, preparations included."""
        self._closed.set()

    def keep_moment(self) -> None:
        """Ask for a snapshot of the next frame's moment."""
        self._moment_wanted.set()

    def keep_view(self) -> None:
        """Ask for the next frame's view as a file."""
        self._view_wanted.set()

    def note_aid(self, text: str) -> None:
        """Record with the next frame that an aid was switched: which, on or off."""
        self._aids.append(text)

    def run(self) -> FinishedFlight | None:
        """Fly to the end; None where that came before the first pose.

        Raises `DeviceLostError` when the device failed in flight, DeviceError or
        TimeoutError when it failed before or nothing is recorded, UserError for input
        that cannot be flown.
        """
        try:
            with RendererCompiler() as compiler:
                return self._run(compiler)
        except EndedError:
            return None
        finally:
            self._tell(events.FlightOver(self.result))

    def _run(self, compiler: RendererCompiler) -> FinishedFlight | None:
        order = self.order
        scenario, has_instrument = order.scenario, order.has_own_tool
        before = load_patient(scenario, self._progress)
        check_fit(scenario, before)
        self.head = before
        # kernels may be compiled from here on: no bar stands full meanwhile
        self._progress("Preparing the tissue", 0.0)
        # divides the head's mucosa, which is kept: no device waits for it
        divided = Preparation(lambda: coverage_watch(before))
        patient, operation = operate_on(before)
        self.hand.felt_n = lambda: operation.touch.size_n
        self.hand.is_scope_laid = lambda: order.input.is_laid
        order.input.operated(operation.patient)
        if self.path is None:
            self.path = start_path(patient, scenario.start)
        # tissue at rest holds a tool: what is shown has given way to it already
        rest = operation.patient.surface.distance
        hand = partial(pointed_tool, patient, rest, self.path, scenario)
        self.hand.pointed = hand()
        self._tell(events.HeadLoaded(patient))

        # much of it lets go of the interpreter, as much of what is beside it
        rehearsal = Rehearsal(self._require_open)
        compiled = partial(compiler.wait, rehearsal)
        rehearsed = Preparation(
            lambda: rehearse(scenario, before, rehearsal, compiled, hand())
        )
        compiler.wait(self._progress)
        size = (self.size, self.size)
        view = build_view(
            scenario, patient, threads=order.threads, progress=self._progress
        )
        divided.wait(self._require_open)
        view.warm_up(first_views(scenario, patient, self.path, size), self._progress)
        rehearsed.wait(lambda: self._progress(*rehearsal.staged))
        self._progress("Opening the input", 0.0)
        with ExitStack() as stack:
            if self.hand.pointed is not None:
                planner = stack.enter_context(ThreadPoolExecutor(1, "pointing"))
                self.hand.pointed.beside = planner
            streamer = stack.enter_context(streaming(order.stream))
            poses = stack.enter_context(order.input.open(patient))
            if order.instrument is None:
                self.hand.turns = order.input.turns
                order.input.on_swap(self.hand.swap)
            else:
                second = stack.enter_context(order.instrument.open(patient))
                self.hand.follow(order.instrument, second)
            self._progress("Opening the input", 1.0)
            reached = ReachedPoses(CancellableSource(poses, self._closed, self._ended))
            source = ReconnectingSource(
                reached,
                order.patience_s,
                lambda loss: self._tell(events.DeviceLost(loss)),
                lambda away_s: self._tell(events.DeviceBack(away_s)),
            )
            registration, residual_mm = self._register(source)
            order.input.placed(registration)
            info = describe_session(
                scenario,
                patient,
                registration,
                size=self.size,
                has_instrument=has_instrument,
            )
            matrix = self.hand.world_from_device = registration.world_from_device
            reached.reach = Reach.of(before.surface.distance, matrix)
            reaches = [reached.reach]
            session = build_session(scenario, patient, matrix, size, operation)
            self.session = session
            self.hand.open_task = partial(_open_name, scenario.tasks, session)
            recorder = self.recording.open(stack, info)
            if order.instrument is not None:
                second.reach = Reach.of(before.surface.distance, np.eye(4))
                reaches.append(second.reach)
                second.on_loss = second.on_return = partial(
                    self._on_tool_device, recorder, session
                )
            self._tell(events.RecordingBegan(residual_mm))
            self._channel.on_pedal = partial(self._on_pedal, recorder)
            if streamer is not None:
                self._channel.on_sample = partial(
                    publish_sample, streamer, matrix, has_instrument
                )
            timing = self._follow(source, session, view, recorder, patient)
            for reach in reaches:
                if told := reach.told():
                    recorder.add(EventRecord(session.last_s, "device", told))
            if not recorder.samples:
                return None
            score = session.score()
            recorder.close({"score": asdict(score), "timing": timing.figures()})
        was_ended = self._ended.is_set() or self._closed.is_set()
        title = "The flight is over" if was_ended else "The path is flown"
        self.result = self.recording.end(title, score)
        self._keep_keyframes(before)
        return FinishedFlight(patient, view, info, timing, score)

    def _keep_keyframes(self, before: PatientScene) -> None:
        """Keep what makes a replay quick; nobody waits for it but the program's end."""
        folder = self.recording.folder
        if folder is None:
            return
        saving = partial(save_keyframes, folder, before, self._keyframes)
        # a program that is ending starts no thread: then there are none
        with suppress(RuntimeError):
            threading.Thread(target=saving, name="keyframes").start()

    def _tell(self, event: FlightEvent) -> None:
        for hear in self._hearers:
            hear(event)

    def _require_open(self, stage: str = "", share: float = 0.0) -> None:
        """End a preparation that nobody waits for any more; it is told by no one."""
        if self._closed.is_set():
            raise ClosedError

    def _progress(self, stage: str, share: float) -> None:
        self._require_open()
        self._tell(events.Progressed(stage, share))

    def _register(self, source: OrderedPoses) -> tuple[Registration, float | None]:
        """Ask for the fiducials to be touched, unless the input lies in the patient.

        With the residual in mm rms, where it was measured.
        """
        known = self.order.input.registration
        if known is not None:
            return known, None
        fiducials = self.order.scenario.fiducial_positions()
        registration = register_by_touch(
            source,
            fiducials,
            lambda stage, share: self._tell(events.Touching(stage, share)),
        )
        return registration, registration.residual_rms_mm

    def _on_pedal(
        self, recorder: SessionRecorder, event: ButtonEvent, sample: Sample
    ) -> None:
        """Record a pedal; the right one keeps the moment, the left works the tool."""
        if sample.time_s < 0.0:
            return
        recorder.add(pedal_record(event, sample.time_s))
        if event.is_down and event.button == Button.RIGHT_PEDAL:
            self.keep_moment()
        if event.button == Button.LEFT_PEDAL and not self.order.input.has_instrument:
            self.hand.work(event.is_down)

    def _on_tool_device(
        self, recorder: SessionRecorder, session: Session, text: str
    ) -> None:
        """Record that the tool's device was lost, or is back."""
        recorder.add(EventRecord(session.last_s, "device", text))
        self._tell(events.ToolDeviceNews(text))

    def _follow(
        self,
        source: ReconnectingSource,
        session: Session,
        view: EndoscopeView,
        recorder: SessionRecorder,
        patient: PatientScene,
    ) -> Timing:
        """Fly until the path ends, somebody ends it or the device is lost for good."""
        tell = self._tell

        def note(text: str, later_s: float = 0.0) -> None:
            recorder.add(EventRecord(session.last_s + later_s, "device", text))

        def on_loss(loss: DeviceError) -> None:
            note(str(loss))
            tell(events.DeviceLost(loss))

        def on_return(away_s: float) -> None:
            note(f"The device is back after {away_s:.1f} s.", away_s)
            tell(events.DeviceBack(away_s))

        def on_late(text: str) -> None:
            note(text)
            tell(events.StoodStill(text))

        def on_left_out(count: int) -> None:
            on_late(f"This machine is too slow for the input: {count} poses left out.")

        def keeps(time_s: float) -> bool:
            asked = self._moment_wanted.is_set() or self._view_wanted.is_set()
            return asked or self._keeps_tissue(time_s)

        def on_frame(event: FrameEvent) -> None:
            while self._aids:
                text = self._aids.popleft()
                recorder.add(EventRecord(event.sample.time_s, "aid", text))
            # a frame that was begun before somebody asked is not the one
            if self._moment_wanted.is_set() and event.tissue is not None:
                self._moment_wanted.clear()
                text = f"frame {event.number}"
                recorder.add(EventRecord(event.sample.time_s, "snapshot", text))
                tell(events.MomentKept(event))
            if self._view_wanted.is_set() and event.tissue is not None:
                self._view_wanted.clear()
                tell(events.ViewSaved(*save_frame_view(self.order, patient, event)))
            tell(event)

        source.on_loss, source.on_return = on_loss, on_return
        source.on_late = on_late
        # what the first picture does not show
        over = threading.Event()
        tools = Preparation(
            lambda: view.prepare_tools(partial(over.wait, TOOL_PAUSE_S))
        )
        try:
            return fly(
                source,
                self._channel.join,
                session,
                view,
                recorder,
                until_s=self.order.input.until_s,
                on_frame=on_frame,
                keeps=keeps,
                listeners=Listeners(
                    lambda text: tell(events.Injured(text)),
                    tell,
                    self.order.input.changed,
                    on_left_out,
                ),
                pace=FramePacing(self.order.input.may_skip, self.picture),
                keyframes=self._keyframes,
                at_bite=self.hand.at_bite,
            )
        except (DeviceError, TimeoutError) as error:
            note(str(error))
            if recorder.samples:
                self.result = self.recording.end("The arm was lost", session.score())
            if self.recording.folder is None:
                raise
            raise DeviceLostError(error, self.recording.folder) from error
        finally:
            over.set()
            tools.wait(lambda: None)


def _open_name(every: Sequence[Task], session: Session) -> str | None:
    """Return the name of the task that is to be done now."""
    if session.tasks is None:
        return None
    opened = open_task(every, session.tasks.states)
    return None if opened is None else opened[0].name


class FlightRecording:
    """Open the recording of a flight and remember where it is.

    folder: None where none is kept. problem: why, one sentence.
    """

    def __init__(self, order: FlightOrder, on_problem: Callable[[str], None]) -> None:
        """Prepare; on_problem: told what ends it while the flight goes on."""
        self._order = order
        self._on_problem = on_problem
        self.folder: Path | None = None
        self.problem = ""

    def open(self, stack: ExitStack, info: SessionInfo) -> SessionRecorder:
        """Begin to record; the stack closes it.

        Without a named folder, a flight that cannot be kept goes on unrecorded.
        """
        order = self._order
        if order.record is not None:
            named = SessionRecorder(order.record, info, self._on_refusal)
            self.folder = order.record
            return stack.enter_context(named)
        if order.kept is not None:
            automatic = msgspec.structs.replace(info, automatic=True)
            place: Path | None = None
            try:
                held = order.kept.new_session(order.scenario.name)
                place = stack.enter_context(held)
                kept = SessionRecorder(place, automatic, self._on_refusal)
                recorder = stack.enter_context(kept)
            except OSError as error:
                self.problem = f"{order.kept.folder} cannot be written ({error})."
                if place is not None:
                    shutil.rmtree(place, ignore_errors=True)
            else:
                self.folder = place
                return recorder
        scratch = tempfile.TemporaryDirectory(prefix="paravol-train-")
        folder = Path(stack.enter_context(scratch))
        return stack.enter_context(SessionRecorder(folder, info))

    def _on_refusal(self, error: OSError) -> None:
        """Fly on without a recording; what was written stays as it is."""
        self.problem = (
            f"{self.folder} cannot be written on ({error.strerror or error}); what was "
            "flown before that is there."
        )
        self._on_problem(self.problem)

    def end(self, title: str, score: Score) -> FlightEnd:
        """Return how the flight ended."""
        automatic = self._order.record is None
        if self.folder is not None and not (self.folder / "stream.mcap").exists():
            self.problem = f"{self.folder} was removed while it was recorded."
            self.folder = None
        return FlightEnd(title, score, self.folder, automatic, self.problem)


def save_frame_view(
    order: FlightOrder, patient: PatientScene, event: FrameEvent
) -> tuple[str, str]:
    """Write the view of a frame, with its gain, for `paravol snapshot --view`.

    It lies in the recording that was asked for, or in the working directory. Return a
    message and where the file is, or why there is none: a disk that refuses ends no
    flight.
    """
    folder = Path() if order.record is None else order.record / "snapshots"
    time_s = event.sample.time_s
    file = folder / f"view-{time_s:.2f}.view.json"
    view = view_of(
        event.view,
        order.scenario,
        patient,
        gain=event.frame.gain,
        number=event.number,
        operated=mark_of(event.tissue, order.record, time_s),
        has_instrument=True,
        lens=event.frame.lens,
    )
    try:
        folder.mkdir(parents=True, exist_ok=True)
        save_view(file, view)
    except OSError as error:
        return "The view was not saved", str(error)
    return f"Saved the view at {time_s:.1f} s", str(file)
