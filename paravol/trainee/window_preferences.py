"""What a person chose of the window: looks, mouse, keys; kept from start to start."""

from pathlib import Path

import msgspec
import platformdirs

from system import UserError, whole_file
from system.typed_record import read_kept

FONT_SCALES = (0.8, 1.5)
"""Smallest and largest factor on the window's texts."""

SPEEDS = (0.25, 4.0)
"""Smallest and largest factor on what the mouse asks for; of keys 1 is the largest."""


class WindowPreferences(msgspec.Struct, frozen=True, omit_defaults=True):
    """The choices; what another version wrote beside them is left out.

    theme: a name of `app.window.themes`; one that is not there is as good as the first.
    font_scale: factor on every text, within `FONT_SCALES`. mouse_speed, wheel_speed,
    key_speed: factors, within `SPEEDS`. language: its code; "" for the system's. keys:
    of actions by their names, both of `app.window.keyboard.actions`; those that are not
    there have their first keys.
    """

    theme: str = "dark"
    font_scale: float = 1.0
    mouse_speed: float = 1.0
    wheel_speed: float = 1.0
    key_speed: float = 1.0
    language: str = ""
    inverts_pitch: bool = False
    inverts_wheel: bool = False
    swaps_buttons: bool = False
    keys: dict[str, str] = {}

    def checked(self) -> "WindowPreferences":
        """Return the choices with their factors within bounds."""
        return msgspec.structs.replace(
            self,
            font_scale=_within(FONT_SCALES, self.font_scale),
            mouse_speed=_within(SPEEDS, self.mouse_speed),
            wheel_speed=_within(SPEEDS, self.wheel_speed),
            key_speed=_within((SPEEDS[0], 1.0), self.key_speed),
        )


def _within(bounds: tuple[float, float], factor: float) -> float:
    low, high = bounds
    return min(max(factor, low), high) if factor == factor else 1.0


def preferences_file() -> Path:
    """Return where the user's choices are kept."""
    folder = platformdirs.user_config_path("paravol", appauthor=False)
    return folder / "window.json"


def read_preferences(file: Path | None = None) -> WindowPreferences:
    """Return what was chosen; the first choice where there is none, or it is damaged.

    A window opens in any case: what it looks like is not worth an error.
    """
    chosen = read_kept(file or preferences_file(), WindowPreferences)
    return (chosen or WindowPreferences()).checked()


def write_preferences(chosen: WindowPreferences, file: Path | None = None) -> None:
    """Keep what was chosen; UserError where it cannot be written."""
    file = file or preferences_file()
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        with whole_file(file) as beside:
            beside.write_bytes(msgspec.json.encode(chosen) + b"\n")
    except OSError as error:
        raise UserError(
            f"The choice cannot be kept: {file} cannot be written ({error.strerror}); "
            "it holds until the window closes."
        ) from error
