"""The options of `paravol train` that come in groups, with their help."""

from dataclasses import dataclass
from pathlib import Path

from cyclopts import Parameter


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True, slots=True)
class HapticOptions:
    """Options of what pushes back.

    Parameters
    ----------
    haptics
        What pushes back: none, emulated (a force device that the chosen input holds)
        or force-dimension (one on this machine, which steers by itself).
    haptics_fault
        Let the emulated force device fail: NAME[@SECONDS[+DURATION]] with stuck,
        saturated, silent, lying or unplugged, such as silent@10+1.
    """

    haptics: str = "none"
    haptics_fault: str | None = None

    @property
    def are_asked_for(self) -> bool:
        """Return whether anything but the default was typed."""
        return self.haptics != "none" or self.haptics_fault is not None


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True, slots=True)
class ClosingOptions:
    """Options of a window that closes by itself.

    Parameters
    ----------
    seconds
        Close the window by itself after this time.
    screenshot
        Save a picture of the window when it closes.
    """

    seconds: float | None = None
    screenshot: Path | None = None


NO_HAPTICS = HapticOptions()
NEVER = ClosingOptions()
