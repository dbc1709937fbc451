"""The words of `--input`, turned into an input."""

from pathlib import Path

from devices import ProbePath
from paravol.inputs.flight_input import FlightInput
from scenarios import Scenario
from system import UserError

FORMS = (
    "mouse, emulator, gamepad[:FILE or :NUMBER], recording:FILE or "
    "igtl:HOST:PORT[:TOOL]"
)


def choose_input(
    words: str | None,
    device: str | None,
    scenario: Scenario,
    path: ProbePath | None,
    path_file: Path | None,
    registration: Path | None = None,
    roll: str | None = None,
) -> FlightInput:
    """Make the input that the words name; a device is a MicroScribe's serial port.

    path, path_file: what was recorded for the exercise; None where nothing was.
    words: None for the arm at the device, or the mouse without one.

    registration: a file of `paravol register`, for an arm or a tracker. roll: what
    knows the roll of the scope in a real arm, the words of `paravol.inputs.arm_roll`;
    None for the horizon.

    Raises UserError for words that name none, DeviceError when a gamepad is asked
    for and there is none.
    """
    if device is not None and words is not None:
        raise UserError(
            f"--device names a MicroScribe's port; leave it out to fly with {words!r}."
        )
    if roll is not None and device is None:
        raise UserError(
            "--roll says who knows the roll of the arm at --device; every other input "
            "knows its own."
        )
    is_tracker = words is not None and words.startswith("igtl:")
    if registration is not None and device is None and not is_tracker:
        if words == "emulator":
            raise UserError(
                "--registration says where the arm at --device stands; the emulated "
                "arm stands elsewhere each time and registers itself."
            )
        raise UserError(
            "--registration is for an arm or a tracker; leave it out to fly with "
            f"{words or 'mouse'!r}."
        )
    if device is not None or words == "emulator":
        from paravol.inputs.arm import ArmInput

        return ArmInput(
            scenario, path, path_file, device, registration, roll or "horizon"
        )
    kind, _, rest = (words if words is not None else "mouse").partition(":")
    match kind, rest:
        case "mouse", "":
            from paravol.inputs.hand import MouseInput

            return MouseInput(scenario, path)
        case "gamepad", file:
            from paravol.inputs.hand import GamepadInput

            return GamepadInput(scenario, path, *pad_words(file))
        case "recording", file if file:
            from paravol.inputs.recording import RecordingInput

            return RecordingInput(Path(file))
        case "igtl", address if address:
            from paravol.inputs.igtl import LinkInput, peer_address

            return LinkInput(*peer_address("--input", address), scenario, registration)
    raise UserError(f"--input must be {FORMS}; got {words!r}.")


def pad_words(text: str) -> tuple[Path | None, int]:
    """Read what follows "gamepad:": its file, or its number, the first for nothing."""
    if text.isascii() and text.isdigit() and int(text) > 0:
        return None, int(text)
    return (Path(text) if text else None), 1
