"""`paravol train`: the trainee's window, from the check of the display to its end."""

import math
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

from app.cli.page_window import OpenedWindow
from app.cli.root import thread_count
from app.cli.train_options import AS_USUAL, TrainOptions
from app.opengl import OpenGL, remembered_trial
from system import UserError

if TYPE_CHECKING:
    from pathlib import Path

    from app.window.navigator import NavigatorOrder
    from paravol.exercises.training_setup import TrainingSetup
    from paravol.flight.flight_events import FlightEnd, Hear
    from paravol.trainee.window_preferences import WindowPreferences
    from scenarios import Scenario

SIZES = (64, 2048)
"""Smallest and largest picture, pixels."""

TRIAL = "first_flight"
"""Exercise by which devices are tried that were typed, when none is named."""


def train(*, options: TrainOptions = AS_USUAL) -> int:
    """Open the trainee's window: endoscope, overview, frame rate."""
    options = replace(options, threads=thread_count(options.threads))
    _check(options)
    with ExitStack() as stack:
        watcher = None
        if options.instructor_page is not None:
            watcher = stack.enter_context(_instructor_page(options.instructor_page))
        answer = stack.enter_context(remembered_trial())
        return _train(options, training_setup(options, watcher), answer)


@contextmanager
def _instructor_page(port: int) -> "Iterator[Callable[[Scenario], Hear]]":
    """Serve the instructor's page and say where; give what shows it a flight."""
    from paravol.instructor import InstructorPage

    with InstructorPage(port) as page:
        print(f"The instructor's page: {page.address}", flush=True)
        yield page.watcher


def _train(
    options: TrainOptions, setup: "TrainingSetup", trial: Callable[[], OpenGL]
) -> int:
    """Fly in the window; see `run_train`.

    trial: waits for the trial of OpenGL that goes on beside.
    """
    from paravol.inputs.open_arm import require_port

    if options.case is not None:
        order = setup.order_for_case(options.case)
    else:
        # without a name a trial: what was typed wrongly is told before a window opens
        order = setup.order(options.scenario or TRIAL, partial(_attempts, options))
    require_port(options.device)
    opened = OpenedWindow(trial(), options.screenshot, chosen_looks(options))

    from PySide6.QtCore import QTimer

    from app.window.navigator import Navigator

    window = opened.window
    desk = Navigator(window, _desk_order(options, setup, opened.edge_samples))

    def shut_later() -> None:
        if options.seconds is not None:
            QTimer.singleShot(round(options.seconds * 1e3), window.shut)

    def begin() -> None:
        window.show()
        for begun in (desk.first_shown, desk.stopped):
            begun.connect(shut_later)
        if options.case is not None:
            desk.take_off(order, partial(desk.fly_case, options.case))
        elif options.scenario is not None:
            desk.take_off(order, partial(desk.fly, options.scenario))
        else:
            desk.open_home()
            shut_later()

    opened.run(begin)
    desk.close()
    window.release()
    for flown in desk.flown:
        if flown.end is not None:
            _tell(flown.scenario.title, flown.end, flown.last_lines)
            if flown.is_kept:
                print("Kept in paravol progress; --no-store leaves a session out.")
            elif not options.no_store:
                keep_session(flown.end.record, flown.trainee)
    opened.raise_problem(desk.error)
    return 0


def _attempts(options: TrainOptions, exercise: str) -> int:
    """Return how many attempts at an exercise are kept of who is named."""
    from paravol.trainee.record import attempts_of

    return 0 if options.no_store else attempts_of(options.trainee, exercise)


def chosen_looks(options: TrainOptions) -> "WindowPreferences":
    """Return the window's looks: as typed, else as they were chosen last."""
    import msgspec

    from paravol.trainee.window_preferences import read_preferences

    looks = read_preferences()
    if options.theme is not None:
        looks = msgspec.structs.replace(looks, theme=options.theme.replace("-", " "))
    if options.font_scale is not None:
        looks = msgspec.structs.replace(looks, font_scale=options.font_scale)
    return looks


def _desk_order(
    options: TrainOptions, setup: "TrainingSetup", edge_samples: int
) -> "NavigatorOrder":
    from app.window.navigator import NavigatorOrder

    is_named = options.scenario is not None or options.case is not None
    named = (options.input, options.device, options.haptics_fault)
    return NavigatorOrder(
        setup,
        # at home whoever was there last is offered; a flight that is named has nobody
        trainee=options.trainee if is_named else options.trainee or None,
        has_store=not options.no_store,
        has_sound=options.sound == "on",
        volume=options.volume,
        edge_samples=edge_samples,
        has_typed_devices=any(named) or options.haptics != "none",
    )


def training_setup(
    options: TrainOptions,
    watcher: "Callable[[Scenario], Hear] | None" = None,
) -> "TrainingSetup":
    """Return what the options say of devices, picture and recording.

    watcher: makes who looks on at each flight.
    """
    from paravol.exercises.training_setup import DeviceSetup, TrainingSetup

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
        watcher=watcher,
        patient=options.patient,
    )


def _tell(title: str, end: "FlightEnd", last_lines: Sequence[str]) -> None:
    """Print a flight's result: a window takes it along when it closes."""
    from app.cli.terminal import print_table

    print_table(title, end.rows())
    print("\n".join([*end.lines(), *last_lines]))


def keep_session(
    record: "Path | None", trainee: str, store: "Path | None" = None
) -> None:
    """Score a flight's recording and add it to the progress store.

    record: None where it was not recorded. store: None for the user's. What goes wrong
    is said, and costs nothing of the flight.
    """
    from paravol.progress.keep_flight import keep_flight

    if record is None:
        return
    kept = keep_flight(record, trainee, store)
    place = sys.stderr if kept.entry is None else sys.stdout
    print("\n".join(kept.said), file=place)


def _check(options: TrainOptions) -> None:
    """Refuse bad options before anything slow begins."""
    from paravol.progress.session_entry import require_name

    require_name(options.trainee)
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
    if record is not None and options.scenario is None and options.case is None:
        raise UserError(
            f"--record {record} names one flight: say which by --scenario or --case. "
            "What is flown from the home page is recorded without being asked."
        )
    # Checked now, not after the arm was registered.
    if (
        record is not None
        and record.exists()
        and (not record.is_dir() or any(record.iterdir()))
    ):
        raise UserError(
            f"{record} is there already; choose another name for --record or remove it."
        )
