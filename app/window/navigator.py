"""The way through the window: home, a flight, its result, and on from there."""

import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

import msgspec
from PySide6.QtCore import QObject, Signal

from app.window.background_work import BackgroundWork, words_for
from app.window.ending import PATIENCE_S, begin_ending, wait_for
from app.window.flight.ended_page import EndedPage
from app.window.flight.flight_page import FlightPage
from app.window.flight.flight_thread import FlightThread, ThreadEnding, WindowEvent
from app.window.flight.flight_tour import flight_stops
from app.window.home.exercise_list import ListEntry
from app.window.home.home_page import HomePage
from app.window.main_window import MainWindow
from app.window.opened_file import open_file
from app.window.page import Page, TextPage
from app.window.result.debrief_process import write_beside
from app.window.session_page import with_patient
from app.window.texts import later, tr
from app.window.tour import Tour
from paravol.exercises.training_setup import TrainingSetup
from paravol.flight.flight import FlightOrder
from paravol.flight.flight_events import FlightEnd
from paravol.inputs.open_arm import require_port
from paravol.patient import PatientScene, Progress, load_case, load_patient
from paravol.sessions.session_setup import flown_scenario
from paravol.sessions.unfinished_sessions import (
    UnfinishedSession,
    discard,
    recover,
    unfinished_sessions,
)
from paravol.trainee.cases import KnownCase, add_case, is_case, known_cases
from paravol.trainee.choices import ChoiceFile
from paravol.trainee.found_devices import EMULATOR, MOUSE, FoundDevice, find_devices
from paravol.volume.scan import Scan, scans_of
from scenarios import Scenario, Score
from scenarios.bundle import read_recording
from scenarios.ladder import ExerciseStatus

if TYPE_CHECKING:
    from app.window.result.result_page import ResultPage
    from paravol.trainee.record import TraineeRecord
    from paravol.trainee.session_result import SessionResult

HOME_TOUR, FLIGHT_TOUR = "home", "flight"
DEBRIEF = "debrief.html"
NO_BROWSER = later("No browser could be opened.")
RESULT_PAGE = "app.window.result.result_page"
"""It loads what scores a flight; no flight waits for that."""

REPLAY_PAGE = "app.window.replay.replay_page"
"""It loads what draws heads; it is loaded beside the home page."""

VOLUME_PAGE = "app.window.volume.volume_page"
"""It loads what draws a scan; it is loaded beside the window, as the scan is."""

AS_TYPED = "as typed"
"""Words of the devices that the command line named."""

_P = TypeVar("_P", bound=Page)
_T = TypeVar("_T")


@dataclass(frozen=True, slots=True)
class NavigatorOrder:
    """How one trains at this window.

    trainee: made-up name; None for the one of the last time. has_store: sessions enter
    the progress store. store: its file, None for the user's. choices: the file of what
    is remembered. edge_samples: see `FlightPage`. has_typed_devices: the setup's
    devices were typed, and are offered beside those found.
    """

    setup: TrainingSetup
    trainee: str | None = None
    has_store: bool = True
    store: Path | None = None
    choices: Path | None = None
    has_sound: bool = False
    volume: float = 1.0
    edge_samples: int = 0
    has_typed_devices: bool = False


@dataclass(slots=True)
class Flown:
    """One flight of this window, for what is told when it closes.

    trainee: who flew. end: how it ended, None where nothing was flown. last_lines: of
    the input. is_kept: it is in the progress store. thread: None once it was left.
    """

    scenario: Scenario
    trainee: str
    thread: FlightThread | None
    end: FlightEnd | None = None
    last_lines: Sequence[str] = ()
    is_kept: bool = False

    def take_end(self, thread: FlightThread) -> FlightEnd | None:
        """Take over how the flight ended, and return it."""
        self.end = thread.flight.result
        self.last_lines = thread.flight.order.input.last_lines()
        return self.end


@dataclass(slots=True)
class _Known:
    """What was read for the home page."""

    record: "TraineeRecord | None" = None
    cases: list[KnownCase] = field(default_factory=list)


class Navigator(QObject):
    """Own the window's pages, and what they have in common.

    flown: flights, in order. error: of a flight without a home page to tell it on.
    """

    first_shown = Signal()
    """A flight's first picture is there."""

    stopped = Signal()
    """An error ended a flight; it is told on the page."""

    def __init__(self, window: MainWindow, order: NavigatorOrder) -> None:
        super().__init__()
        self.flown: list[Flown] = []
        self.error: Exception | None = None
        self._window = window
        self._order = order
        self._setup = order.setup
        self._file = ChoiceFile(order.choices)
        self._choices = self._file.load()
        self._trainee = (
            self._choices.trainee if order.trainee is None else order.trainee
        )
        self._has_home = False
        self._known = _Known()
        self._devices = [MOUSE, EMULATOR]
        self._device = MOUSE.words
        if order.has_typed_devices:
            self._devices.insert(0, _typed(order.setup))
            self._device = AS_TYPED
        self._has_found = False
        self._again: Callable[[], None] | None = None
        self._wanted: object = None
        """What is being prepared on the page that is shown; None for nothing."""
        self._works: set[BackgroundWork] = set()
        self._endings: list[threading.Thread] = []
        window.dropped.connect(self._drop)

    # Home

    def open_home(self, problem: str = "") -> None:
        """Show the home page; problem: what is to be told there."""
        self._has_home = True
        page = HomePage()
        page.card.names_patients = self._setup.patient is None
        page.left.connect(self._window.shut)
        page.given_up.connect(self._give_up)
        page.exercise_wanted.connect(self.fly)
        page.case_wanted.connect(self.fly_case)
        page.scan_wanted.connect(self._show_scan)
        page.bar.connection.clicked.connect(self.connect_arm)
        page.bar.trainee_chosen.connect(self._take_trainee)
        page.bar.device_chosen.connect(self._take_device)
        page.tour_ended.connect(partial(self._note_tour, HOME_TOUR))
        page.recordings_wanted.connect(self.replay)
        page.settings_wanted.connect(self._window.show_settings)
        page.bar.show_devices(self._devices, self._device, is_all=self._has_found)
        page.bar.show_trainees([], self._trainee)
        self._window.show_page(page)
        self._leave_flights()
        self._do(lambda _: import_module(REPLAY_PAGE), lambda _: None)
        page.say(problem or tr(self._file.told))
        if self._known.record is not None:
            self._fill_home(self._known)
        self._read_record()
        if not self._has_found:
            self._do(lambda _: find_devices(), self._take_found)
        page.recovery.recover_wanted.connect(self._recover)
        page.recovery.keep_wanted.connect(self._keep_unfinished)
        page.recovery.discard_wanted.connect(self._discard)
        self._do(lambda _: unfinished_sessions(self._order.setup.sessions), self._offer)

    def _offer(self, found: list[UnfinishedSession]) -> None:
        """Offer what killed flights left, but for what is to stay as it is."""
        left = [f for f in found if f.folder.name not in self._choices.unfinished]
        if (page := self._page(HomePage)) is not None:
            page.recovery.show_unfinished(left)

    def _recover(self, session: UnfinishedSession) -> None:
        """Give a recording its end and show what the flight was worth."""
        page = self._page(HomePage)
        assert page is not None

        def work(progress: Progress) -> tuple[Scenario, Score]:
            info = read_recording(session.folder).info
            scenario = flown_scenario(session.folder, info, None)
            return scenario, recover(session, progress)

        def show(found: tuple[Scenario, Score]) -> None:
            scenario, score = found
            end = FlightEnd(
                later("The flight was cut off"), score, session.folder, True
            )
            flown = Flown(scenario, self._trainee, None, end)
            self.flown.append(flown)
            case = scenario.head.case
            self._again = partial(self.fly, scenario.name)
            if case:
                self._again = partial(self.fly_case, Path(case))
            if self._window.page is page:
                self._show_result(flown)

        self._do(work, show, staged=page.show_stage)

    def _keep_unfinished(self, session: UnfinishedSession) -> None:
        name = session.folder.name
        self._remember(unfinished=(*self._choices.unfinished, name))

    def _discard(self, session: UnfinishedSession) -> None:
        self._do(lambda _: discard(session), lambda _: None)

    def _read_record(self) -> None:
        trainee, store, cases = self._trainee, self._order.store, self._choices.cases

        def work(progress: Progress) -> _Known:
            from paravol.trainee.record import record_of

            return _Known(record_of(trainee, store), known_cases(cases))

        self._do(work, self._fill_home)

    def _fill_home(self, known: _Known) -> None:
        page, record = self._page(HomePage), known.record
        if record is None or record.trainee != self._trainee:
            return
        is_first = self._known.record is None
        self._known = known
        if page is None:
            return
        if record.told:
            page.say(tr(record.told))
        page.bar.show_trainees(record.trainees, self._trainee)
        page.show_ladder(record.ladder, known.cases, self._choices.exercise)
        if is_first and HOME_TOUR not in self._choices.tours:
            page.start_tour()

    def _take_trainee(self, name: str) -> None:
        self._trainee = name
        self._remember(trainee=name)
        self._read_record()

    def _take_found(self, found: list[FoundDevice]) -> None:
        self._has_found = True
        typed = [d for d in self._devices if d.words == AS_TYPED]
        self._devices = [*typed, *found]
        words = [device.words for device in found if not device.problem]
        if not typed and self._choices.device in words:
            self._choose(next(d for d in found if d.words == self._choices.device))
        if (page := self._page(HomePage)) is not None:
            page.bar.show_devices(self._devices, self._device, is_all=True)

    def _take_device(self, device: FoundDevice) -> None:
        self._choose(device)
        self._remember(device=device.words)
        if (page := self._page(HomePage)) is not None:
            page.say(tr(device.problem))

    def _choose(self, device: FoundDevice) -> None:
        self._device = device.words
        typed = self._order.setup
        if device.words == AS_TYPED:
            self._setup = typed
        else:
            self._setup = replace(typed, devices=device.chosen(typed.devices))

    def connect_arm(self) -> None:
        """Show the page of arms."""
        from app.window.connection.connection_page import ConnectionPage

        page = ConnectionPage(self._devices, chosen=self._setup.devices.port)
        page.left.connect(self.open_home)
        page.registered.connect(self._take_registration)
        self._window.show_page(page)

    def _take_registration(self, port: str, file: Path) -> None:
        """Let flights with the arm at a port use its registration."""
        devices = self._order.setup.devices
        self._order = replace(
            self._order,
            setup=replace(
                self._order.setup, devices=replace(devices, registration=file)
            ),
        )
        if self._setup.devices.port == port:
            mine = replace(self._setup.devices, registration=file)
            self._setup = replace(self._setup, devices=mine)

    def _show_scan(self, entry: ListEntry) -> None:
        """Show the scan of an exercise's head, or of a case."""
        page = self._window.page
        assert isinstance(page, HomePage)
        wanted = self._begin_work(tr("Preparing the scan"))

        def work(progress: Progress) -> tuple[str, list[Scan]]:
            import_module(VOLUME_PAGE)
            if entry.exercise is not None:
                done = len(entry.exercise.attempts)
                flown = self._setup.attempt(entry.exercise.scenario, done + 1)
                title, patient = with_patient(flown), load_patient(flown, progress)
            else:
                assert entry.case is not None
                title = entry.case.title
                patient = load_case(entry.case.folder, progress)
            return title, scans_of(patient.scene.volume, patient.others)

        def show(found: tuple[str, list[Scan]]) -> None:
            from app.window.volume.volume_page import VolumePage

            shown = VolumePage(*found, self._setup.threads)
            shown.left.connect(self.open_home)
            self._window.show_page(shown)

        def stage(words: str, share: float) -> None:
            if wanted():
                page.show_stage(words, share)

        self._do(work, show, staged=stage, wanted=wanted)

    # A flight

    def fly(self, exercise: str) -> None:
        """Prepare an exercise and fly it; one that is locked is told on home."""
        record = self._known.record
        known = None if record is None else record.ladder.find(exercise)
        if known is not None and known.door is ExerciseStatus.LOCKED:
            waits = ", ".join(map(tr, known.waits))
            self._tell(
                tr(
                    "{title} is locked: first pass {waits}.",
                    title=tr(known.scenario.title),
                    waits=waits,
                )
            )
            return

        def take_off(order: FlightOrder) -> None:
            self._remember(exercise=exercise)
            self.take_off(order, partial(self.fly, exercise))

        self._prepare(lambda: self._setup.order(exercise, self._attempts), take_off)

    def _attempts(self, exercise: str) -> int:
        """Return how many attempts at an exercise are kept of who trains here."""
        from paravol.trainee.record import attempts_of

        if not self._order.has_store:
            return 0
        return attempts_of(self._trainee, exercise, self._order.store)

    def fly_case(self, folder: Path) -> None:
        """Prepare a flight through a case and fly it."""

        def take_off(order: FlightOrder) -> None:
            self._remember(cases=add_case(self._choices.cases, folder))
            self.take_off(order, partial(self.fly_case, folder))

        self._prepare(lambda: self._setup.order_for_case(folder), take_off)

    def take_off(self, order: FlightOrder, again: Callable[[], None]) -> None:
        """Show the page of a flight and begin; again: begins the same once more."""
        self._again = again
        thread = FlightThread(
            order, has_sound=self._order.has_sound, volume=self._order.volume
        )
        # not Python's garbage collection ends it, which may run in any thread
        thread.setParent(self)
        thread.guide.is_on = self._choices.has_guide
        page = FlightPage(thread, edge_samples=self._order.edge_samples)
        page.guide_switched.connect(lambda is_on: self._remember(has_guide=is_on))
        flown = Flown(order.scenario, self._trainee, thread)
        page.left.connect(partial(self._on_left, flown, thread))
        page.first_shown.connect(self._on_first_shown)
        page.begun.connect(partial(self._show_flight_tour, page))
        thread.told.connect(partial(self._hear, flown, thread))
        self._window.show_page(page)
        self._leave_flights()
        self.flown.append(flown)
        thread.start()

    def _prepare(
        self, order: Callable[[], FlightOrder], take_off: Callable[[FlightOrder], None]
    ) -> None:
        """Make an order beside the window: it opens files and devices."""
        port, wanted = self._setup.devices.port, self._begin_work(tr("Preparing"))

        def work(progress: Progress) -> FlightOrder:
            require_port(port)
            return order()

        self._do(work, take_off, wanted=wanted)

    def _begin_work(self, stage: str) -> Callable[[], bool]:
        """Say what is being prepared; return whether it still is wanted.

        Who went elsewhere meanwhile, or gave it up, does not want it any more.
        """
        page, wanted = self._window.page, object()
        self._wanted = wanted
        if isinstance(page, TextPage):
            page.say("")
            page.show_stage(stage)
        return lambda: self._window.page is page and self._wanted is wanted

    def _give_up(self) -> None:
        """Want nothing any more of what is being prepared."""
        self._wanted = None
        if (page := self._page(HomePage)) is not None:
            page.show_stage("")

    def _tell(self, problem: str) -> None:
        """Say on the page what went wrong: where there is room for it, or on home."""
        page = self._page(TextPage)
        if page is None:
            self.open_home(problem)
        else:
            page.show_stage("")
            page.say(problem)

    def _on_first_shown(self) -> None:
        self.first_shown.emit()
        # beside the flight, so that its end need not wait for it
        self._do(lambda _: import_module(RESULT_PAGE), lambda _: None)

    def _show_flight_tour(self, page: FlightPage) -> None:
        """Show a trainee who flies for the first time what there is to see."""
        if not self._has_home or FLIGHT_TOUR in self._choices.tours:
            return
        page.stand(FLIGHT_TOUR, True)
        stops = flight_stops(page, has_tools=page.has_tools)
        tour = Tour(page, stops, self._window.scale)

        def end() -> None:
            page.stand(FLIGHT_TOUR, False)
            page.setFocus()
            self._note_tour(FLIGHT_TOUR)

        tour.ended.connect(end)

    def _on_left(self, flown: Flown, thread: FlightThread) -> None:
        """Go home from a flight that was left; tell what ended one, where it did."""
        error, end = thread.error, flown.take_end(thread)
        if error is None:
            self.open_home()
        elif end is not None:
            self._show_result(flown, thread.flight.head, words_for(error))
        else:
            page = EndedPage(flown.scenario.title, words_for(error))
            page.left.connect(self._window.shut)
            page.home_wanted.connect(self.open_home)
            page.again_wanted.connect(self._fly_again)
            self._window.show_page(page)
        if error is not None:
            self.stopped.emit()

    def _hear(self, flown: Flown, thread: FlightThread, event: WindowEvent) -> None:
        """Show a flight's result; leave one that ended before anything was flown."""
        if isinstance(event, FlightEnd):
            flown.take_end(thread)
        if flown is not self.flown[-1] or self._page(FlightPage) is None:
            return
        if isinstance(event, FlightEnd):
            self._show_result(flown, thread.flight.head)
        elif isinstance(event, ThreadEnding) and not (
            thread.flight.result or thread.error
        ):
            self._on_left(flown, thread)

    # Its result

    def _show_result(
        self, flown: Flown, head: PatientScene | None = None, problem: str = ""
    ) -> None:
        """Show a flight's figures, then what it was worth; head: None to load it."""
        from app.window.result.result_page import ResultPage, what_next

        assert flown.end is not None
        scenario = flown.scenario
        page = ResultPage(scenario, flown.end, problem)
        page.left.connect(self._window.shut)
        page.home_wanted.connect(self.open_home)
        page.next_wanted.connect(self.fly)
        page.again_wanted.connect(self._fly_again)
        page.debrief_wanted.connect(partial(self._write_debrief, page))
        page.written.folder_wanted.connect(partial(self._open_folder, page))
        page.replay_wanted.connect(partial(self.replay, head=head))
        self._window.show_page(page)
        if flown.end.record is None:
            return
        kept, store = self._order.has_store, self._order.store
        record, trainee = flown.end.record, flown.trainee

        def work(progress: Progress) -> "tuple[SessionResult, TraineeRecord]":
            from paravol.trainee.record import record_of
            from paravol.trainee.session_result import ResultOrder, result_of_session

            order = ResultOrder(
                record, trainee, has_store=kept, store=store, patient=head
            )
            return result_of_session(order, progress), record_of(trainee, store)

        def show(found: "tuple[SessionResult, TraineeRecord]") -> None:
            result, record = found
            flown.is_kept = result.is_kept
            known = _Known(record, self._known.cases)
            # who went home meanwhile sees it there
            if self._page(HomePage) is not None:
                self._fill_home(known)
            self._known = known
            if self._window.page is page:
                page.show_result(result)
                page.show_next(what_next(record, scenario.name))

        def fail(text: str) -> None:
            if self._window.page is page:
                page.show_stage("")
                page.say(tr("The flight cannot be scored: {text}", text=text))

        self._do(work, show, fail, staged=page.show_stage)

    def replay(
        self, record: Path | None = None, head: PatientScene | None = None
    ) -> None:
        """Show the page of replays; record: None for one that is chosen there.

        head: that was flown through, where it is loaded already.
        """
        from app.window.replay.replay_page import ReplayPage
        from paravol.sessions.replay_events import ReplayOrder

        page = ReplayPage(edge_samples=self._order.edge_samples)
        page.left.connect(self.open_home)
        self._window.show_page(page)
        self._leave_flights()
        if record is not None:
            page.replay(ReplayOrder(record, patient=head))
            return

        def show(found: list[Path]) -> None:
            page.welcome.show_recent(found[::-1])

        self._do(
            lambda _: self._order.setup.sessions.sessions(),
            show,
            wanted=lambda: self._window.page is page,
        )

    def _drop(self, folders: Sequence[Path]) -> None:
        """Open what was dropped on the window: sessions are replayed, a case flown.

        A flight that is under way asks first; to drop again is an answer.
        """
        from app.window.replay.replay_page import ReplayPage

        page = self._window.page
        if isinstance(page, HomePage) and is_case(folders[0]):
            self.fly_case(folders[0])
        elif isinstance(page, ReplayPage):
            page.open(folders)
        elif page.may_leave():
            for flown in self.flown:
                if flown.thread is not None:
                    flown.take_end(flown.thread)
            self.replay()
            self._drop(folders)

    def _fly_again(self) -> None:
        assert self._again is not None
        self._again()

    def _write_debrief(self, page: "ResultPage", record: Path) -> None:
        """Write the debrief beside the recording and open it in the browser."""
        page.debrief.setEnabled(False)
        threads, file, row = self._setup.threads, record / DEBRIEF, page.written

        def work(progress: Progress) -> bool:
            write_beside(record, file, threads, progress)
            return open_file(file)

        def show(is_open: bool) -> None:
            page.debrief.setEnabled(True)
            row.show_file(file, "" if is_open else tr(NO_BROWSER))

        def fail(text: str) -> None:
            page.debrief.setEnabled(True)
            row.hide()
            page.say(tr("The debrief cannot be written: {text}", text=text))

        page.say("")
        row.show_stage(tr("beginning"))
        self._do(
            work,
            show,
            fail,
            staged=row.show_stage,
            wanted=lambda: self._window.page is page,
        )

    def _open_folder(self, page: "ResultPage", folder: Path) -> None:
        """Have the desktop show a folder; say where it is if it cannot."""

        def show(is_open: bool) -> None:
            if not is_open and self._window.page is page:
                page.say(
                    tr("No program could open the folder {folder}.", folder=folder)
                )

        self._do(lambda _: open_file(folder), show)

    # Closing, and what all of it needs

    def close(self) -> None:
        """End what is under way; a flight's recording gets its end."""
        for flown in self.flown:
            if flown.thread is not None:
                flown.thread.stop(PATIENCE_S)
                flown.take_end(flown.thread)
                self.error = flown.thread.error
        wait_for(self._endings)

    def _leave_flights(self) -> None:
        """Let go of earlier flights beside the window: what they still draw ends."""
        for flown in self.flown:
            if flown.thread is not None:
                self._endings.append(begin_ending(flown.thread, flown.thread.stop))
                flown.thread = None

    def _note_tour(self, name: str) -> None:
        if name not in self._choices.tours:
            self._remember(tours=(*self._choices.tours, name))

    def _remember(self, **changed: object) -> None:
        self._choices = msgspec.structs.replace(self._choices, **changed)
        self._file.save(self._choices)

    def _page(self, kind: type[_P]) -> _P | None:
        page = self._window.page
        return page if isinstance(page, kind) else None

    def _do(
        self,
        work: Callable[[Progress], _T],
        done: Callable[[_T], None],
        failed: Callable[[str], None] | None = None,
        *,
        staged: Callable[[str, float], None] | None = None,
        wanted: Callable[[], bool] = lambda: True,
    ) -> None:
        """Do something beside the window; tell what becomes of it while it is wanted.

        failed: hears why nothing came of it; None to say it on the page.
        """
        begun = BackgroundWork(work, self)
        self._works.add(begun)

        def tell(hear: Callable[..., None], *words: object) -> None:
            if wanted():
                hear(*words)

        begun.done.connect(partial(tell, done))
        begun.failed.connect(partial(tell, failed or self._tell))
        if staged is not None:
            # a method of a widget, which ends with it, or what asks by itself
            begun.staged.connect(staged)
        for ended in (begun.done, begun.failed):
            ended.connect(lambda _: self._works.discard(begun))
        begun.start()


def _typed(setup: TrainingSetup) -> FoundDevice:
    devices = setup.devices
    named = devices.scope or devices.port or devices.haptics
    return FoundDevice(AS_TYPED, tr("{named} (as started)", named=named))
