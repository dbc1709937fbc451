"""Keyboard and mouse as controls of a scope. Knows keys by their names, no window."""

from dataclasses import dataclass, field

from devices.controls.steering import Freedom, SteeringEvents

KEYS: dict[str, tuple[Freedom, int]] = {
    "W": (Freedom.INSERT, 1),
    "S": (Freedom.INSERT, -1),
    "Left": (Freedom.YAW, -1),
    "Right": (Freedom.YAW, 1),
    "Up": (Freedom.PITCH, 1),
    "Down": (Freedom.PITCH, -1),
    "D": (Freedom.ROLL, 1),
    "A": (Freedom.ROLL, -1),
}
"""What each key asks for while it is down."""

FINE_KEY = "Shift"
FINE_SHARE = 0.25
"""Speed of the keys while the fine key is down."""

PEDAL_KEYS = {"1": 1, "2": 2}
"""Keys that stand for the right and the left pedal."""

HELP = {
    "W S": "move in, move out",
    "← → ↑ ↓": "tilt about the nostril",
    "A D": "turn the light post",
    "Shift": "slowly",
    "Drag": "tilt; right button: turn the post",
    "Wheel": "move in and out",
}
"""What to show to whoever sits at the keyboard."""

TILT_DEG_PER_PIXEL = 0.06
"""A picture 800 pixels wide covers the whole cone of a nostril."""

ROLL_DEG_PER_PIXEL = 0.25
INSERT_MM_PER_NOTCH = 1.5


@dataclass(slots=True)
class MouseKeys:
    """Turn keys and strokes of the mouse into what they ask of the scope.

    A state machine of its own: every event comes with its time, on the clock of the
    source that the steering feeds. Keys it does not know are told apart by the return
    value, so that a window can use them otherwise.
    """

    steering: SteeringEvents
    _down: set[str] = field(default_factory=set)

    def key(self, name: str, is_down: bool, at_s: float) -> bool:
        """Take a key that went down or up; tell whether it belongs to the scope.

        Repeats of a key that is held change nothing. Two keys that ask for opposite
        things cancel while both are down.
        """
        if name not in KEYS and name not in PEDAL_KEYS and name != FINE_KEY:
            return False
        if (name in self._down) == is_down:
            return True
        if is_down:
            self._down.add(name)
        else:
            self._down.discard(name)
        if name in PEDAL_KEYS:
            self.steering.press(PEDAL_KEYS[name], is_down, at_s)
        elif name == FINE_KEY:
            for freedom in Freedom:
                self._hold(freedom, at_s)
        else:
            self._hold(KEYS[name][0], at_s)
        return True

    def drag(self, right_px: float, down_px: float, rolls: bool, at_s: float) -> None:
        """Take a stroke with a mouse button down; ``rolls`` for the right button."""
        if rolls:
            self.steering.nudge(Freedom.ROLL, right_px * ROLL_DEG_PER_PIXEL, at_s)
            return
        self.steering.nudge(Freedom.YAW, right_px * TILT_DEG_PER_PIXEL, at_s)
        self.steering.nudge(Freedom.PITCH, -down_px * TILT_DEG_PER_PIXEL, at_s)

    def wheel(self, notches: float, at_s: float) -> None:
        """Take a turn of the wheel, positive away from the hand: inwards."""
        self.steering.nudge(Freedom.INSERT, notches * INSERT_MM_PER_NOTCH, at_s)

    def release(self, at_s: float) -> None:
        """Let go of every key: whoever looks elsewhere lifts keys unseen."""
        for name in sorted(self._down):
            self.key(name, False, at_s)

    def _hold(self, freedom: Freedom, at_s: float) -> None:
        asked = sum(
            sign
            for name, (what, sign) in KEYS.items()
            if what == freedom and name in self._down
        )
        share = FINE_SHARE if FINE_KEY in self._down else 1.0
        self.steering.hold(freedom, asked * share, at_s)
