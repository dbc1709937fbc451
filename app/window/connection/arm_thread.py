"""Look at an arm, or register it, in a thread of its own; one of the two at a time."""

import threading
from collections.abc import Callable

from PySide6.QtCore import QObject, Signal

from app.window.background_work import words_for
from app.window.ending import begin_ending
from app.window.texts import tr
from devices import DeviceError
from devices.microscribe import MicroScribe
from paravol.exercises.exercise_path import recorded_path_file
from paravol.inputs.open_arm import open_arm
from paravol.inputs.pose_sources import ClosedError
from paravol.registration.arm_registration import RegistrationOrder, register_arm
from paravol.registration.arm_watch import ArmWatch
from scenarios import load_scenario

SHOWN_S = 0.1
"""Between two readings that the page is told of."""

HEAD = "first_flight"
"""Exercise whose head is registered, and whose path the emulated arm follows."""


class ArmThread(QObject):
    """Work with the arm at a port, None for the emulated one."""

    connected = Signal(str, str)
    """The arm, and whether it stands in its home position."""
    reading = Signal(object)
    """An `ArmReading`."""
    problem = Signal(str)
    """Why the arm cannot be looked at, or that it is away; "" once it can."""
    said = Signal(str)
    """A line for whoever registers."""
    staged = Signal(str, float)
    registered = Signal(object)
    """A `Registered`."""
    ended = Signal()
    """Nothing is going on any more."""

    def __init__(self) -> None:
        super().__init__()
        self._closed = threading.Event()
        # with their ports
        self._threads: list[tuple[str | None, threading.Thread]] = []

    def watch(self, port: str | None) -> None:
        """Look at an arm."""
        self._begin(port, lambda closed: self._watch(port, closed))

    def register(self, order: RegistrationOrder) -> None:
        """Lead through a registration."""
        self._begin(order.port, lambda closed: self._register(order, closed))

    def stop(self) -> None:
        """End what is going on; returns at once."""
        self._closed.set()

    def leave(self) -> threading.Thread:
        """End what is going on; see `begin_ending`.

        A port at which nothing answers is waited for for seconds.
        """
        self._closed.set()
        return begin_ending(self, self._ended)

    def _ended(self, patience_s: float) -> bool:
        for _, thread in self._threads:
            thread.join(patience_s)
        return not any(thread.is_alive() for _, thread in self._threads)

    def _begin(self, port: str | None, work: Callable[[threading.Event], None]) -> None:
        """Work in a thread, after those before it at its port: that has one user."""
        self._closed.set()
        self._threads = [each for each in self._threads if each[1].is_alive()]
        before = [thread for used, thread in self._threads if used == port]
        closed = threading.Event()
        self._closed = closed

        def run() -> None:
            for thread in before:
                thread.join()
            if closed.is_set():
                # whoever switches quickly does not wait for each
                return
            try:
                work(closed)
            except ClosedError:
                pass
            except Exception as error:
                if not closed.is_set():
                    self.problem.emit(words_for(error))
            if self._closed is closed:
                self.ended.emit()

        thread = threading.Thread(target=run, name="arm", daemon=True)
        self._threads.append((port, thread))
        thread.start()

    def _watch(self, port: str | None, closed: threading.Event) -> None:
        scenario, folder = load_scenario(HEAD)
        path_file = recorded_path_file(scenario, folder)
        with open_arm(scenario, path_file, device=port) as arm:
            if closed.is_set():
                return
            about = arm.description.identity
            self.connected.emit(
                tr(
                    "{name} {model}, serial number {serial}",
                    name=about.product_name,
                    model=about.model,
                    serial=about.serial,
                ),
                arm.home_state.value,
            )
            self.problem.emit("")
            self._look(arm, closed)

    def _look(self, arm: MicroScribe, closed: threading.Event) -> None:
        watch, shown_s, is_away = ArmWatch(), -SHOWN_S, False
        while not closed.is_set():
            try:
                pose = arm.read(SHOWN_S)
            except TimeoutError:
                continue
            except DeviceError as loss:
                # its driver looks for it, and has no poses until it is there again
                self.problem.emit(str(loss))
                is_away = True
                closed.wait(SHOWN_S)
                continue
            if is_away:
                self.problem.emit("")
                is_away = False
            reading = watch.feed(pose, arm.counts)
            if not 0.0 <= pose.host_time_s - shown_s < SHOWN_S:
                shown_s = pose.host_time_s
                self.reading.emit(reading)

    def _register(self, order: RegistrationOrder, closed: threading.Event) -> None:
        found = register_arm(order, _SignalGuide(self), closed)
        self.registered.emit(found)


class _SignalGuide:
    """Pass on what a registration says."""

    def __init__(self, thread: ArmThread) -> None:
        self._thread = thread

    def __call__(self, stage: str, share: float) -> None:
        self._thread.staged.emit(stage, share)

    def say(self, text: str) -> None:
        self._thread.said.emit(tr(text.strip()))
