"""A gamepad or a 3D mouse as controls of a scope."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Protocol

from devices.controls.linux_input import (
    EV_ABS,
    EV_KEY,
    EV_REL,
    AxisRange,
    InputDescription,
    InputDevice,
    InputEvent,
    input_devices,
)
from devices.controls.rumble import Rumble, open_rumble
from devices.controls.steering import SWAP_BUTTON, Axis, SteeringEvents
from devices.port import Clock, DeviceError, DeviceReason, HostClock

X, Y, Z, RX, RY, RZ = range(6)
"""The kernel's codes of axes, the same for absolute and relative ones."""

FIRST_BUTTON, SECOND_BUTTON, THIRD_BUTTON = 0x130, 0x131, 0x133
"""A pad's lower, right and upper button, by the kernel's gamepad layout."""

OLD_BUTTONS = (0x120, 0x121, 0x123)
"""The same of a pad that tells its buttons by numbers, as most without a driver do."""

THROTTLE = 0x06
"""An axis of flight sticks, which have those buttons, too."""

MOUSE_BUTTONS = (0x100, 0x101)

PAD_AXES = {
    X: (Axis.YAW, 1),
    Y: (Axis.PITCH, -1),
    RX: (Axis.ROLL, 1),
    RY: (Axis.INSERT, -1),
}
"""Sticks: the kernel counts right and towards the hand as positive."""

OTHER_AXES = {X: PAD_AXES[X], Y: PAD_AXES[Y], Z: PAD_AXES[RX], RZ: PAD_AXES[RY]}
"""The right stick of a pad without a driver; `RX` and `RY` may be its triggers."""

MOUSE_AXES = {
    Y: (Axis.INSERT, -1),
    RX: (Axis.PITCH, 1),
    RY: (Axis.ROLL, -1),
    RZ: (Axis.YAW, 1),
}
"""A 3D mouse's cap: push it forwards, tip it, lean it, twist it."""

HELP = {
    "Left stick": "tilt about the nostril",
    "Right stick ↑ ↓": "move in, move out",
    "Right stick ← →": "turn the light post",
    "A B": "keep the moment; work the tool",
}

MOUSE_HELP = {
    "Push, pull": "move in, move out",
    "Tip, twist": "tilt about the nostril",
    "Lean": "turn the light post",
    "Buttons": "keep the moment; work the tool",
}

DEAD_SHARE = 0.08
"""Worn sticks rest this far off their middle."""

RELATIVE_RANGE = AxisRange(-350, 350)
"""Deflection of a 3D mouse that is counted as relative by some kernels."""

RELATIVE_S = 0.1
"""Such a mouse falls silent instead of saying zero; it repeats itself every 16 ms."""


@dataclass(frozen=True, slots=True)
class GamepadLayout:
    """Which control does what."""

    axes: dict[int, tuple[Axis, int]]
    buttons: dict[int, int]
    help: dict[str, str]


PAD = GamepadLayout(
    PAD_AXES, {FIRST_BUTTON: 1, SECOND_BUTTON: 2, THIRD_BUTTON: SWAP_BUTTON}, HELP
)
MOUSE = GamepadLayout(
    MOUSE_AXES, dict(zip(MOUSE_BUTTONS, (1, 2), strict=True)), MOUSE_HELP
)


class EventSource(Protocol):
    """What a gamepad needs of a device."""

    @property
    def description(self) -> InputDescription:
        """Return which controls there are."""
        ...

    def read(self) -> Sequence[InputEvent]:
        """Return what happened since the last time; never waits."""
        ...

    def close(self) -> None:
        """Let go of the device; harmless when repeated."""
        ...


class Gamepad:
    """Pass on what happens to a gamepad or 3D mouse; a `Handset`."""

    def __init__(self, device: EventSource, clock: Clock | None = None) -> None:
        """Take over an opened device; DeviceError when it is neither of the two."""
        layout = layout_of(device.description)
        if layout is None:
            raise DeviceError(
                DeviceReason.WRONG_DEVICE,
                f"{device.description.name} has neither the sticks of a gamepad nor "
                "the axes of a 3D mouse.",
            )
        self.name = device.description.name
        self.layout = layout
        self.rumble: Rumble | None = None
        """Its motors, where it has any that may be used; it closes them."""
        self._device = device
        self._clock: Clock = HostClock() if clock is None else clock
        self._moved_s: dict[int, float] = {}

    def poll(self, steering: SteeringEvents) -> None:
        """Pass on what happened since the last time; DeviceError if it went away."""
        for event in self._device.read():
            if event.kind == EV_KEY and event.code in self.layout.buttons:
                button = self.layout.buttons[event.code]
                steering.press(button, event.value != 0, event.time_s)
            elif event.kind in (EV_ABS, EV_REL) and event.code in self.layout.axes:
                self._deflect(steering, event)
        now = self._clock.now()
        for code, moved_s in list(self._moved_s.items()):
            if now - moved_s > RELATIVE_S:
                del self._moved_s[code]
                steering.hold(self.layout.axes[code][0], 0.0, moved_s + RELATIVE_S)

    def close(self) -> None:
        """Let go of the device; harmless when repeated."""
        if self.rumble is not None:
            self.rumble.close()
        self._device.close()

    def _deflect(self, steering: SteeringEvents, event: InputEvent) -> None:
        if event.kind == EV_REL:
            self._moved_s[event.code] = event.time_s
            extent = RELATIVE_RANGE
        else:
            extent = self._device.description.absolute.get(event.code, AxisRange(-1, 1))
        axis, sign = self.layout.axes[event.code]
        steering.hold(axis, sign * deflection(event.value, extent), event.time_s)


def layout_of(description: InputDescription) -> GamepadLayout | None:
    """Return the layout of a gamepad or a 3D mouse, None for anything else."""
    absolute = description.absolute
    is_numbered = OLD_BUTTONS[0] in description.keys and {Z, RZ} <= absolute.keys()
    is_numbered &= THROTTLE not in absolute
    if (is_numbered or FIRST_BUTTON in description.keys) and {X, Y} <= absolute.keys():
        return _pad(description)
    six = {X, Y, Z, RX, RY, RZ}
    if six <= description.relative or (
        six <= description.absolute.keys() and MOUSE_BUTTONS[0] in description.keys
    ):
        return MOUSE
    return None


def _pad(description: InputDescription) -> GamepadLayout:
    """Return a pad's layout: its right stick is the pair that rests in the middle."""
    absolute, layout = description.absolute, PAD
    pairs = [pair for pair in ((RX, RY), (Z, RZ)) if {*pair} <= absolute.keys()]
    off = [max(absolute[code].off_middle for code in pair) for pair in pairs]
    if pairs and pairs[off.index(min(off))] == (Z, RZ):
        layout = replace(layout, axes=OTHER_AXES)
    if FIRST_BUTTON not in description.keys:
        buttons = dict(zip(OLD_BUTTONS, PAD.buttons.values(), strict=True))
        layout = replace(layout, buttons=buttons)
    return layout


def deflection(value: int, extent: AxisRange) -> float:
    """Return the share of full deflection, -1 to 1; gentle near the middle.

    Within the dead zone it is zero; beyond it rises with the square, so that a hand
    steers finely and still reaches the full speed.
    """
    half = (extent.high - extent.low) / 2
    if half <= 0:
        return 0.0
    share = (value - (extent.high + extent.low) / 2) / half
    dead = min(max(DEAD_SHARE, extent.flat / half), 0.5)
    beyond = (min(abs(share), 1.0) - dead) / (1.0 - dead)
    if beyond <= 0.0:
        return 0.0
    return beyond * beyond if share > 0.0 else -beyond * beyond


def open_gamepad(path: Path | None = None, number: int = 1) -> Gamepad:
    """Open the gamepad or 3D mouse of a number, from 1, or the one at ``path``.

    Raises DeviceError, in one sentence, when there is none.
    """
    if path is not None:
        return _with_rumble(Gamepad(InputDevice(path)), path)
    refused: DeviceError | None = None
    found = 0
    for candidate in input_devices():
        try:
            device = InputDevice(candidate)
        except DeviceError as error:
            refused = error
            continue
        found += layout_of(device.description) is not None
        if found == number:
            return _with_rumble(Gamepad(device), candidate)
        device.close()
    if refused is not None:
        raise refused
    if found:
        raise DeviceError(
            DeviceReason.NO_DEVICE,
            f"There is no gamepad {number}, only {found}; plug another one in.",
        )
    raise DeviceError(
        DeviceReason.NO_DEVICE,
        "There is no gamepad or 3D mouse; plug one in, or fly with --input mouse.",
    )


def _with_rumble(pad: Gamepad, path: Path) -> Gamepad:
    pad.rumble = open_rumble(path)
    return pad
