"""What the window remembers of whoever sits there: a small JSON file of theirs."""

from pathlib import Path

import msgspec
import platformdirs

from scenarios.bundle import write_json
from system import UserError
from system.typed_record import decode_json

NAME = "trainee.json"


class Choices(msgspec.Struct, frozen=True):
    """What was chosen the last time; what another version kept is left out.

    trainee: made-up name, "" for none. device: words of a `FoundDevice`. exercise: name
    of what was flown last. cases: folders, the newest first. tours: names of the tours
    that were shown. unfinished: names of recordings without an end that stay as they
    are. has_guide: the way to a task's place is shown.
    """

    trainee: str = ""
    device: str = ""
    exercise: str = ""
    cases: tuple[str, ...] = ()
    tours: tuple[str, ...] = ()
    unfinished: tuple[str, ...] = ()
    has_guide: bool = True


class ChoiceFile:
    """Read and write the choices; what goes wrong is told and ends nothing.

    told: what the user must know, "" for nothing.
    """

    def __init__(self, file: Path | None = None) -> None:
        """Take a file; None for the user's own, below the configuration directory."""
        if file is None:
            folder = platformdirs.user_config_path("paravol", appauthor=False)
            file = folder / NAME
        self.file = file
        self.told = ""

    def load(self) -> Choices:
        """Return what is remembered; the usual where there is nothing to be read."""
        try:
            return decode_json(
                self.file.read_bytes(), Choices, self.file, "earlier choices"
            )
        except FileNotFoundError:
            return Choices()
        except (UserError, OSError) as error:
            self.told = f"Your earlier choices are forgotten: {error}"
            return Choices()

    def save(self, choices: Choices) -> None:
        """Write them, whole or not at all."""
        try:
            write_json(self.file, choices)
        except OSError as error:
            self.told = f"Your choices cannot be remembered: {error}"
