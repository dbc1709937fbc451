"""Options of devices: where they stand, who knows the roll, what moves the tool."""

from dataclasses import dataclass
from pathlib import Path


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


ONE_DEVICE = DeviceOptions()
