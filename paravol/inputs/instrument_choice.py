"""The words of `--instrument`, turned into a second input."""

from pathlib import Path

from devices import ProbePath
from paravol.inputs.igtl import peer_address
from paravol.inputs.input_choice import pad_words
from paravol.inputs.instrument_input import (
    ArmInstrument,
    GamepadInstrument,
    InstrumentInput,
    LinkInstrument,
    MouseInstrument,
    RecordedInstrument,
)
from scenarios import Scenario
from system import UserError

FORMS = (
    "mouse, gamepad[:FILE or :NUMBER], igtl:HOST:PORT[:TOOL], arm:PORT or "
    "recording:FILE"
)

SIDES = "right", "left"


def choose_instrument(
    words: str,
    scope: str | None,
    device: str | None,
    scenario: Scenario,
    path: ProbePath | None,
    registration: Path | None = None,
    side: str | None = None,
) -> InstrumentInput:
    """Make the second input that the words name.

    scope, device: the words of `--input` and the port of `--device`, which move the
    scope. registration: a file of `paravol register`, for an arm or a tracker. side: of
    the nostril, "right" or "left", for what is steered; None for that of the scope.

    Raises UserError for words that name none, or the same device as the scope's, and
    DeviceError when a gamepad is asked for and there is none.
    """
    kind, _, rest = words.partition(":")
    _check_side(kind, side)
    if registration is not None and kind not in ("arm", "igtl"):
        raise UserError(
            "--instrument-registration is for an arm or a tracker; leave it out for "
            f"--instrument {words}."
        )
    scope = scope or ("mouse" if device is None else None)
    _refuse_same(words, scope, device)
    match kind, rest:
        case "mouse", "":
            return MouseInstrument(path, scenario.start, side)
        case "gamepad", which:
            return GamepadInstrument(
                path, scenario.start, side, *_free_pad(which, scope)
            )
        case "igtl", address if address:
            place = peer_address("--instrument", address)
            return LinkInstrument(place, scenario, registration)
        case "arm", port if port:
            return ArmInstrument(port, scenario, registration)
        case "recording", file if file:
            return RecordedInstrument(Path(file))
    raise UserError(f"--instrument must be {FORMS}; got {words!r}.")


def _check_side(kind: str, side: str | None) -> None:
    if side is None:
        return
    if side not in SIDES:
        raise UserError(f"--instrument-side must be right or left, got {side!r}.")
    if kind not in ("mouse", "gamepad"):
        raise UserError(
            "--instrument-side is for a tool that is steered with mouse or gamepad; "
            f"what {kind!r} moves is where it is."
        )


def _refuse_same(words: str, scope: str | None, device: str | None) -> None:
    """Refuse one device for both hands."""
    turns = "leave out --instrument: the key H holds the scope and gives it to the tool"
    kind, _, rest = words.partition(":")
    if kind == "mouse" and scope == "mouse":
        raise UserError(f"One mouse cannot steer scope and tool at once; {turns}.")
    if kind == "arm" and device is not None and rest == device:
        raise UserError(f"The arm at {device} moves the scope already; {turns}.")
    if kind == "igtl" and scope == words:
        raise UserError(
            f"{words} moves the scope already; name another tool, or {turns}."
        )
    if kind == "gamepad" and scope is not None and scope.startswith("gamepad"):
        _, _, other = scope.partition(":")
        if rest and _pad(rest) == _pad(other):
            raise UserError(
                f"--instrument {words} is the gamepad of the scope; name another one, "
                f"such as gamepad:2, or {turns}."
            )


def _pad(which: str) -> tuple[Path | None, int]:
    file, number = pad_words(which)
    return (file.resolve() if file is not None else None), number


def _free_pad(which: str, scope: str | None) -> tuple[Path | None, int]:
    """Return the file or number of a pad; without words the one that is free."""
    if which or scope is None or not scope.startswith("gamepad"):
        return pad_words(which)
    _, number = pad_words(scope.partition(":")[2])
    return None, 2 if number == 1 else 1
