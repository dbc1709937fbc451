"""Pedals for a tracker that has none: what is typed in the terminal.

OpenIGTLink carries poses and no buttons.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

from devices import Pose
from paravol.inputs.pose_sources import OrderedPoses
from paravol.registration.walk import MEASURE_PEDAL, REDO_PEDAL
from system import UserError, typed_text

HELP = (
    "This tracker has no pedals: Enter presses the right one, Enter again lets it go; "
    "b and Enter press the left one for a moment."
)

TAP_S = 0.2
"""Longer than what counts as a press."""


@dataclass(slots=True)
class TypedPedals:
    """Pass a source's poses on, with the pedals that are typed.

    An empty line presses the right pedal or lets it go; one with b taps the left.
    """

    source: OrderedPoses
    typed: Callable[[], str | None] = typed_text
    _is_down: bool = False
    _tapped_until_s: float = float("-inf")
    _line: str = ""

    def read(self, timeout_s: float) -> Pose:
        """Return the next pose; raise as the source does, or UserError."""
        pose = self.source.read(timeout_s)
        for line in self._lines():
            if line.strip().lower() == "b":
                self._is_down = False
                self._tapped_until_s = pose.time_s + TAP_S
            elif not line.strip():
                self._is_down = not self._is_down
        buttons = MEASURE_PEDAL if self._is_down else 0
        if pose.time_s < self._tapped_until_s:
            buttons |= REDO_PEDAL
        return replace(pose, buttons=pose.buttons | buttons)

    def _lines(self) -> list[str]:
        """Return the lines that were finished since the last pose."""
        new = self.typed()
        if new is None:
            raise UserError(
                "Nobody can press Enter here; register a tracker in a terminal."
            )
        *lines, self._line = (self._line + new).split("\n")
        return lines
