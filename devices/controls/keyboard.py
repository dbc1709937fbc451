"""Keyboard and mouse as controls of a scope. Knows what keys ask for, no window."""

from dataclasses import dataclass, field

from devices.controls.steering import Axis, SteeringEvents

MOVES: dict[str, tuple[Axis, int]] = {
    "move in": (Axis.INSERT, 1),
    "move out": (Axis.INSERT, -1),
    "tilt left": (Axis.YAW, -1),
    "tilt right": (Axis.YAW, 1),
    "tilt up": (Axis.PITCH, 1),
    "tilt down": (Axis.PITCH, -1),
    "turn right": (Axis.ROLL, 1),
    "turn left": (Axis.ROLL, -1),
}
"""What keys ask for while they are down."""

FINE = "slowly"
FINE_SHARE = 0.25
"""Speed of the keys while the one is down that slows them."""

PEDALS = {"right pedal": 1, "left pedal": 2}
"""Keys that stand for pedals, and the pedals' bits."""

TILT_DEG_PER_PIXEL = 0.06
"""A picture 800 pixels wide covers the whole cone of a nostril."""

ROLL_DEG_PER_PIXEL = 0.25
INSERT_MM_PER_NOTCH = 1.5


@dataclass(frozen=True, slots=True)
class Feel:
    """Factors on what mouse and keys ask for; a negative one turns it round.

    pitch: on strokes up and down, beside ``drag``. keys: at most 1, as keys that are
    held go as fast as a hand may.
    """

    drag: float = 1.0
    pitch: float = 1.0
    wheel: float = 1.0
    keys: float = 1.0


@dataclass(slots=True)
class MouseKeys:
    """Turn keys and strokes of the mouse into what they ask of the scope.

    A state machine of its own: every event comes with its time, on the clock of the
    source that the steering feeds. Keys it does not know are told apart by the return
    value, so that a window can use them otherwise.
    """

    steering: SteeringEvents
    feel: Feel = Feel()
    _down: set[str] = field(default_factory=set)

    def key(self, name: str, is_down: bool, at_s: float) -> bool:
        """Take what a key asks for, going down or up; tell whether it is steering.

        Repeats of a key that is held change nothing. Two keys that ask for opposite
        things cancel while both are down.
        """
        if name not in MOVES and name not in PEDALS and name != FINE:
            return False
        if (name in self._down) == is_down:
            return True
        if is_down:
            self._down.add(name)
        else:
            self._down.discard(name)
        if name in PEDALS:
            self.steering.press(PEDALS[name], is_down, at_s)
        elif name == FINE:
            for axis in Axis:
                self._hold(axis, at_s)
        else:
            self._hold(MOVES[name][0], at_s)
        return True

    def drag(self, right_px: float, down_px: float, rolls: bool, at_s: float) -> None:
        """Take a stroke with a mouse button down; ``rolls`` for the right button."""
        right_px *= self.feel.drag
        down_px *= self.feel.drag * self.feel.pitch
        if rolls:
            self.steering.nudge(Axis.ROLL, right_px * ROLL_DEG_PER_PIXEL, at_s)
            return
        self.steering.nudge(Axis.YAW, right_px * TILT_DEG_PER_PIXEL, at_s)
        self.steering.nudge(Axis.PITCH, -down_px * TILT_DEG_PER_PIXEL, at_s)

    def wheel(self, notches: float, at_s: float) -> None:
        """Take a turn of the wheel, positive away from the hand: inwards."""
        way_mm = notches * INSERT_MM_PER_NOTCH * self.feel.wheel
        self.steering.nudge(Axis.INSERT, way_mm, at_s)

    def release(self, at_s: float) -> None:
        """Let go of every key: whoever looks elsewhere lifts keys unseen."""
        for name in sorted(self._down):
            self.key(name, False, at_s)

    def _hold(self, axis: Axis, at_s: float) -> None:
        asked = sum(
            sign
            for name, (what, sign) in MOVES.items()
            if what == axis and name in self._down
        )
        share = FINE_SHARE if FINE in self._down else 1.0
        self.steering.hold(axis, asked * share * self.feel.keys, at_s)
