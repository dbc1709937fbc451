"""Options of devices: where they stand, who knows the roll, what moves the tool."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from disk import UserError

if TYPE_CHECKING:
    from devices import ProbePath
    from paravol.inputs.instrument_input import InstrumentInput
    from scenarios import Scenario


@dataclass(frozen=True, kw_only=True, slots=True)
class DeviceOptions:
    """Say how devices are placed, and what moves the tool."""

    registration: Path | None = None
    """File of `paravol register`, made since the arm was switched on, or of a
    tracker."""
    roll: str | None = None
    """Who knows the roll of the scope in the arm at --device: horizon (level, the arrow
    keys turn it), encoder (a sixth joint) or igtl:HOST:PORT[:TOOL]."""
    instrument: str | None = None
    """A second device for the tool: mouse, gamepad[:FILE or :NUMBER],
    igtl:HOST:PORT[:TOOL], arm:PORT or recording:FILE. Without it the tool is carried
    before the lens, and the key H holds the scope and moves the tool."""
    instrument_registration: Path | None = None
    """File of `paravol register` for the arm or tracker that moves the tool."""
    instrument_side: str | None = None
    """Nostril that a steered tool passes, right or left; else that of the scope."""

    def second_input(
        self,
        scope: str | None,
        device: str | None,
        scenario: "Scenario",
        path: "ProbePath | None",
    ) -> "InstrumentInput | None":
        """Make the second input, None without one; see `choose_instrument`."""
        if self.instrument is None:
            if self.instrument_registration is None and self.instrument_side is None:
                return None
            raise UserError(
                "--instrument-registration and --instrument-side go with --instrument."
            )
        from paravol.inputs.instrument_choice import choose_instrument

        return choose_instrument(
            self.instrument,
            scope,
            device,
            scenario,
            path,
            self.instrument_registration,
            self.instrument_side,
        )


ONE_DEVICE = DeviceOptions()
