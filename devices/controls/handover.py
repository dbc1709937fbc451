"""One hand that steers the scope or the tool, by turns."""

import threading
from collections.abc import Callable

from devices.controls.steering import SWAP_BUTTON, Axis, Steering


def _ignore() -> None:
    """Nobody asked to hear of the button."""


class Handover:
    """Pass a hand's events on to one of two steerings; see `SteeringEvents`.

    Whoever loses the hand stops: what was held down counts for it no more, and for the
    other only when it is pressed anew. Pedals always go to the scope. on_swap: called
    when the button that asks for the other is pressed.
    """

    def __init__(self) -> None:
        self.scope = Steering()
        self.tool = Steering()
        self.on_swap: Callable[[], object] = _ignore
        self.is_tools = False
        """Whether the tool has the hand."""
        self._lock = threading.Lock()

    def give(self, to_tool: bool, at_s: float) -> None:
        """Give the hand to the tool, or back to the scope."""
        with self._lock:
            if to_tool == self.is_tools:
                return
            for axis in Axis:
                self._active.hold(axis, 0.0, at_s)
            self.is_tools = to_tool

    def hold(self, axis: Axis, rate: float, at_s: float) -> None:
        """Ask whoever has the hand for a share of the rate limit, -1 to 1."""
        with self._lock:
            self._active.hold(axis, rate, at_s)

    def nudge(self, axis: Axis, way: float, at_s: float) -> None:
        """Ask whoever has the hand for some way at once."""
        with self._lock:
            self._active.nudge(axis, way, at_s)

    def press(self, button: int, is_down: bool, at_s: float) -> None:
        """Press or release the buttons of a bit mask."""
        if button & SWAP_BUTTON:
            if is_down:
                self.on_swap()
            return
        self.scope.press(button, is_down, at_s)

    @property
    def _active(self) -> Steering:
        return self.tool if self.is_tools else self.scope
