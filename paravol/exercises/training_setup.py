"""How somebody trains: devices, picture, recording; it makes orders for flights.

The command line makes one; a window with a home page makes an order from it for each
exercise that is chosen there.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import msgspec

from devices import ProbePath
from paravol.exercises.case_scenario import scenario_of_case
from paravol.exercises.exercise_path import recorded_path, recorded_path_file
from paravol.flight.flight import FlightOrder
from paravol.flight.flight_events import Hear
from paravol.flight.pose_streaming import listening_address
from paravol.inputs import FlightInput, choose_input
from paravol.inputs.instrument_choice import choose_instrument
from paravol.inputs.instrument_input import InstrumentInput
from paravol.sessions.session_store import SessionStore
from scenarios import Scenario, load_scenario
from system import UserError


@dataclass(frozen=True, kw_only=True, slots=True)
class DeviceSetup:
    """What moves the scope and the tool, and what pushes back.

    scope: words of `--input`, None for the arm at the port, or the mouse without one.
    port: of a MicroScribe. registration: where the arm or tracker stands. roll: what
    knows the roll of the arm's scope. instrument: words of a second device, with its
    own registration and nostril. haptics: what pushes back, with the fault it has.
    """

    scope: str | None = None
    port: str | None = None
    registration: Path | None = None
    roll: str | None = None
    instrument: str | None = None
    instrument_registration: Path | None = None
    instrument_side: str | None = None
    haptics: str = "none"
    haptics_fault: str | None = None

    def scope_input(
        self, scenario: Scenario, path: ProbePath | None, path_file: Path | None
    ) -> FlightInput:
        """Return what moves the scope; UserError for words that name nothing."""
        flown = choose_input(
            self.scope,
            self.port,
            scenario,
            path,
            path_file,
            self.registration,
            self.roll,
        )
        if self.haptics == "none" and self.haptics_fault is None:
            return flown
        if self.haptics == "force-dimension" and (self.scope or self.port):
            raise UserError(
                "--haptics force-dimension steers by itself; leave out --input and "
                "--device."
            )
        # here only: its compiled loop costs every start without such a device
        from paravol.inputs.haptic import felt_input

        return felt_input(self.haptics, self.haptics_fault, flown, scenario)

    def tool_input(
        self, scenario: Scenario, path: ProbePath | None
    ) -> InstrumentInput | None:
        """Return the tool's own device, None without one."""
        if self.instrument is None:
            if self.instrument_registration is None and self.instrument_side is None:
                return None
            raise UserError(
                "--instrument-registration and --instrument-side go with --instrument."
            )
        return choose_instrument(
            self.instrument,
            self.scope,
            self.port,
            scenario,
            path,
            self.instrument_registration,
            self.instrument_side,
        )


@dataclass(frozen=True, kw_only=True, slots=True)
class TrainingSetup:
    """What all flights of a training have in common.

    size: largest edge of the square picture, pixels; it follows the window. record:
    folder of the recording; None keeps the newest in `sessions`. stream_igtl: the words
    of `--stream-igtl`. watcher: makes who looks on at each flight; None where nobody
    does. sessions: where flights are recorded without being asked.
    patient: seed of who is flown in every exercise with a phantom's head; None for the
    exercise's own.
    """

    devices: DeviceSetup
    size: int
    threads: int
    record: Path | None = None
    stream_igtl: str | None = None
    watcher: Callable[[Scenario], Hear] | None = None
    sessions: SessionStore = field(default_factory=SessionStore.of_the_user)
    patient: int | None = None

    def order(
        self, scenario: str, attempts: Callable[[str], int] = lambda name: 0
    ) -> FlightOrder:
        """Return the order for an exercise: a bundled one's name, or a file.

        attempts: tells how many there were of the exercise so named.
        Raises UserError for what cannot be flown, DeviceError for a missing device.
        """
        exercise, folder = load_scenario(scenario)
        # with a patient for all nobody looks into the store
        is_next = self.patient is None and len(exercise.head.patients) > 1
        done = attempts(exercise.name) if is_next else 0
        exercise = self.attempt(exercise, done + 1)
        path_file = recorded_path_file(exercise, folder)
        path = None if path_file is None else recorded_path(exercise, folder)
        stream = None
        if self.stream_igtl is not None:
            stream = listening_address(self.stream_igtl)
        second = self.devices.tool_input(exercise, path)
        return FlightOrder(
            exercise,
            path,
            self.devices.scope_input(exercise, path, path_file),
            self.size,
            self.threads,
            self.record,
            stream,
            self.sessions,
            instrument=second,
            watchers=() if self.watcher is None else (self.watcher(exercise),),
            follows_window=True,
        )

    def attempt(self, exercise: Scenario, number: int) -> Scenario:
        """Return an exercise with the patient of an attempt, 1 for the first.

        A recorded path belongs to its own head, which stays.
        """
        head = exercise.head.of_attempt(number)
        if self.patient is not None and not exercise.path:
            head = exercise.head.of_patient(self.patient)
        return msgspec.structs.replace(exercise, head=head)

    def order_for_case(self, case: Path) -> FlightOrder:
        """Return the order for a flight through a case folder."""
        return self.order(str(scenario_of_case(case)))
