"""`paravol train`: the trainee's window, from the check of the display to its end."""

import math
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType, TracebackType
from typing import TYPE_CHECKING

from app.cli.train_options import TrainOptions
from app.opengl import probe_window
from disk import UserError

if TYPE_CHECKING:
    from pathlib import Path

    from paravol.flight import FlightEnd
    from paravol.inputs.flight_input import FlightInput
    from paravol.training_setup import TrainingSetup
    from paravol.window_preferences import WindowPreferences

SIZES = (64, 2048)
"""Smallest and largest picture, pixels."""

EDGE_SAMPLES = 8
"""For smooth edges, where a graphics card draws them."""


def run_train(options: TrainOptions) -> int:
    """Open the window, fly until it is closed and print the result.

    Raises ValueError for bad input, UserError where no window can open, the device's
    error when the arm fails, KeyboardInterrupt after Ctrl-C.
    """
    from paravol.inputs.open_arm import demand_port

    _check(options)
    setup = training_setup(options)
    if options.case is not None:
        order = setup.order_for_case(options.case)
    else:
        order = setup.order(options.scenario)
    demand_port(options.device)
    graphics = probe_window()
    if not graphics.works:
        raise UserError(graphics.problem)

    # Only here: where libraries are missing, loading Qt fails.
    from PySide6.QtCore import QTimer
    from PySide6.QtWidgets import QApplication

    from app.window.flight.flight_page import FlightPage
    from app.window.flight.flight_thread import FlightThread
    from app.window.main_window import MainWindow

    application = QApplication(["paravol"])
    thread = FlightThread(order, has_sound=options.sound == "on", volume=options.volume)
    window = MainWindow(options.screenshot, chosen_looks(options))
    page = FlightPage(thread, edge_samples=0 if graphics.is_software else EDGE_SAMPLES)
    page.left.connect(window.shut)
    page.full_screen_wanted.connect(window.full_screen.switch)
    seconds = options.seconds
    if seconds is not None:
        page.first_shown.connect(
            lambda: QTimer.singleShot(round(seconds * 1e3), window.shut)
        )
    interrupted = False

    def interrupt(number: int, frame: FrameType | None) -> None:
        nonlocal interrupted
        interrupted = True
        window.shut()

    with _errors_of_slots(window.shut) as errors, _on_interrupt(interrupt):
        window.show_page(page)
        window.show()
        thread.start()
        application.exec()
    window.release()
    if thread.flight.result is not None:
        _tell(order.scenario.title, thread.flight.result, order.input)
        if not options.no_store:
            keep_session(
                thread.flight.result.record,
                options.trainee,
                has_head=bool(order.scenario.marks.metrics),
            )
    errors += [thread.error] if thread.error is not None else []
    if errors:
        raise errors[0]
    if interrupted:
        raise KeyboardInterrupt
    return 0


def chosen_looks(options: TrainOptions) -> "WindowPreferences":
    """Return the window's looks: as typed, else as they were chosen last."""
    import msgspec

    from paravol.window_preferences import read_preferences

    looks = read_preferences()
    if options.theme is not None:
        looks = msgspec.structs.replace(looks, theme=options.theme.replace("-", " "))
    if options.font_scale is not None:
        looks = msgspec.structs.replace(looks, font_scale=options.font_scale)
    return looks


def training_setup(options: TrainOptions) -> "TrainingSetup":
    """Return what the options say of devices, picture and recording."""
    from paravol.training_setup import DeviceSetup, TrainingSetup

    placed = options.devices
    devices = DeviceSetup(
        scope=options.input,
        port=options.device,
        registration=placed.registration,
        roll=placed.roll,
        instrument=placed.instrument,
        instrument_registration=placed.instrument_registration,
        instrument_side=placed.instrument_side,
        haptics=options.haptics,
        haptics_fault=options.haptics_fault,
    )
    return TrainingSetup(
        devices=devices,
        size=options.size,
        threads=options.threads,
        record=options.record,
        stream_igtl=options.stream_igtl,
    )


def _tell(title: str, end: "FlightEnd", flown: "FlightInput") -> None:
    """Print a flight's result: a window takes it along when it closes."""
    from app.cli.terminal import print_table

    print_table(title, end.rows())
    print("\n".join([*end.lines(), *flown.last_lines()]))


def keep_session(
    record: "Path | None",
    trainee: str,
    store: "Path | None" = None,
    *,
    has_head: bool = False,
) -> None:
    """Add a flight's recording to the progress store.

    record: None where it was not recorded. store: None for the user's. has_head: with
    the metrics of the head, which must be loaded for it. What goes wrong is said, and
    costs nothing of the flight.
    """
    from paravol.progress import ProgressStore, entry_of_session
    from paravol.session_metrics import session_metrics
    from scenarios.passing import pass_marks

    if record is None:
        return
    try:
        # pass marks may be about what only the head tells
        found = session_metrics(record, has_head=has_head, trusts=True)
        entry = entry_of_session(record, trainee=trainee, metrics=found.metrics)
        kept = ProgressStore(store)
        kept.add(entry)
    except (UserError, OSError) as error:
        print(f"Not kept in paravol progress: {error}", file=sys.stderr)
        return
    if kept.told:
        print(kept.told, file=sys.stderr)
    print("Kept in paravol progress; --no-store leaves a session out.")
    if found.scenario is not None and found.scenario.tasks:
        for mark in pass_marks(found.scenario, entry.tasks, found.metrics):
            if not mark.is_met:
                word = "open" if mark.is_met is None else "missed"
                print(f"Pass mark {word}: {mark.title}: {mark.why or 'not known'}")
        if entry.has_passed:
            print("Passed.")


def _check(options: TrainOptions) -> None:
    """Refuse bad options before anything slow begins."""
    from paravol.progress import demand_name

    demand_name(options.trainee)
    size, record = options.size, options.record
    seconds, screenshot = options.seconds, options.screenshot
    low, high = SIZES
    if not low <= size <= high:
        raise UserError(f"--size must lie between {low} and {high}, got {size}.")
    if seconds is not None and not (math.isfinite(seconds) and seconds > 0):
        raise UserError(f"--seconds must be a positive time, got {seconds:g}.")
    if screenshot is not None:
        if screenshot.suffix.lower() != ".png":
            raise UserError(f"--screenshot must name a .png file, got {screenshot}.")
        if not screenshot.absolute().parent.is_dir():
            raise UserError(f"There is no folder {screenshot.absolute().parent}.")
    # Checked now, not after the arm was registered.
    if (
        record is not None
        and record.exists()
        and (not record.is_dir() or any(record.iterdir()))
    ):
        raise UserError(
            f"{record} is there already; choose another name for --record or remove it."
        )


@contextmanager
def _errors_of_slots(close: Callable[[], object]) -> Iterator[list[BaseException]]:
    """Gather what is raised below Qt, which would only print it and go on."""
    errors: list[BaseException] = []

    def hook(
        kind: type[BaseException], error: BaseException, trace: TracebackType | None
    ) -> None:
        errors.append(error)
        close()

    before, sys.excepthook = sys.excepthook, hook
    try:
        yield errors
    finally:
        sys.excepthook = before


@contextmanager
def _on_interrupt(
    handler: Callable[[int, FrameType | None], None],
) -> Iterator[None]:
    """Call `handler` on Ctrl-C.

    Python gets to it as soon as Qt calls Python next: the window's timer does, ten
    times a second.
    """
    before = signal.signal(signal.SIGINT, handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
