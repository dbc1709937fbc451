"""A MicroScribe arm as input: a real one, or the emulated one on its path."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from devices import ProbePath, Registration
from devices.registration.registration_file import load_registration
from paravol.inputs.arm_roll import ClampedRoll, check_roll, opened_roll
from paravol.inputs.flight_input import FlightInput
from paravol.inputs.open_arm import open_arm
from paravol.inputs.pose_completer import HandChannel, PathChannel
from paravol.inputs.pose_sources import OrderedPoses
from paravol.inputs.turns import ClutchTurns
from paravol.patient import PatientScene
from paravol.registration.at_start import registered_by_file
from scenarios import Scenario
from system import UserError


class ArmInput(FlightInput):
    """Open the arm at a serial port, or the emulated one when there is none.

    registration_file: made by `paravol register` since the arm was switched on; without
    it the fiducials have to be touched. roll: words of `paravol.inputs.arm_roll`, for
    an arm at a port; the emulated one's path has its own. follows_path: the arm at the
    port follows the path, too. faults: of the emulated arm.
    """

    def __init__(
        self,
        scenario: Scenario,
        path: ProbePath | None,
        path_file: Path | None,
        device: str | None,
        registration_file: Path | None = None,
        roll: str = "horizon",
        *,
        follows_path: bool = False,
        faults: tuple[str, ...] = (),
    ) -> None:
        check_roll(roll)
        if registration_file is not None:
            load_registration(registration_file)
        self._registration_file = registration_file
        self._scenario = scenario
        self._path_file = path_file
        self._device = device
        self._faults = faults
        self._roll = roll
        self._hand = HandChannel()
        self.touch_hint = "Hold the stylus on it and press the right pedal."
        self.name = device or "emulated arm"
        if device is not None and not follows_path:
            self.completer = self._hand
            self.turns = ClutchTurns()
            return
        if path is None:
            raise UserError(
                f"The emulated arm follows a recorded path, and the exercise "
                f"{scenario.name!r} has none; fly it with --input mouse or with an arm "
                "at --device."
            )
        self.completer = PathChannel(path)
        self.has_instrument = True
        self.until_s = path.duration_s
        if device is None:
            self.touch_hint = "The emulated arm does it by itself."

    @contextmanager
    def open(self, patient: PatientScene) -> Iterator[OrderedPoses]:
        """Open the port, or start the emulated arm and open its port."""
        with (
            open_arm(
                self._scenario,
                self._path_file,
                device=self._device,
                faults=self._faults,
            ) as arm,
            opened_roll(self._roll, arm.description) as self._hand.roll,
        ):
            if self._registration_file is None:
                yield arm
                return
            poses, self.registration = registered_by_file(
                arm, self._registration_file, arm.description, self._scenario
            )
            yield poses

    def placed(self, registration: Registration) -> None:
        """Tell a sixth encoder which way is up."""
        if isinstance(self._hand.roll, ClampedRoll):
            self._hand.roll.place(registration.world_from_device)
