"""Keys and mouse of the second hand: which tool it holds, and what it does with it."""

from collections.abc import Callable

from PySide6.QtCore import QEvent, QObject, Qt
from PySide6.QtGui import QKeyEvent, QMouseEvent
from PySide6.QtWidgets import QWidget

from paravol.inputs.operating_hand import OperatingHand
from scenarios.instrument_state import NO_TOOL
from scenarios.instruments import INSTRUMENTS, Action

TOOL_KEYS = {
    "T": "next tool; Shift: the one before",
    "B, wheel": "bite or cut, while pressed",
    "N L": "suction; wash the lens",
    "Z": "undo the last cut",
    "Pg↑ Pg↓": "tool ahead, back",
    "Home End": "turn the tool",
    "H": "hold the scope; back",
}
"""What to show to whoever has a free second hand."""

AHEAD_MM, TURN_DEG = 1.0, 15.0
"""Steps of a key that is pressed or held."""

_USES = {
    Action.BITE: "Hold B: its jaws close and bite.",
    Action.POWERED: "N turns its suction on; hold B: it cuts.",
    Action.SCRAPE: "Hold B and drag: it scrapes.",
    Action.CUT: "Hold B and drag: it cuts.",
    Action.INJECT: "Put its tip into the mucosa; hold B: it injects.",
    Action.FEEL: "It takes nothing.",
    Action.SUCK: "N turns its suction on and off.",
}


def tool_use(name: str) -> str:
    """Return how a tool of the catalogue is used, in words."""
    if name == NO_TOOL:
        return "The second hand is free."
    return _USES[INSTRUMENTS[name].action]


class ToolKeys(QObject):
    """Pass a window's keys, and a picture's middle mouse button, to the second hand."""

    def __init__(
        self,
        hand: OperatingHand,
        window: QWidget,
        picture: QWidget,
        notify: Callable[[str, str], None],
    ) -> None:
        """Listen to the window and the picture's mouse.

        notify: says a line and what it means.
        """
        super().__init__(window)
        self._hand = hand
        self._notify = notify
        self.is_sucking = False
        window.installEventFilter(self)
        picture.installEventFilter(self)

    @property
    def names(self) -> tuple[str, ...]:
        """Return the tools that may be taken, the empty hand first."""
        return NO_TOOL, *(self._hand.tools or INSTRUMENTS)

    @property
    def holds_scope(self) -> bool:
        """Return whether the scope is held and its controls move the tool."""
        return self._hand.holds_scope

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Take what belongs to the second hand; let the rest pass."""
        if isinstance(event, QKeyEvent):
            match event.type():
                case QEvent.Type.KeyPress:
                    return self._press(event)
                case QEvent.Type.KeyRelease if event.key() == Qt.Key.Key_B:
                    if not event.isAutoRepeat():
                        self._hand.work(False)
                    return True
        elif isinstance(event, QMouseEvent):
            # a stroke goes on to the scope: a blade cuts while it is dragged
            if event.button() == Qt.MouseButton.MiddleButton:
                self._hand.work(event.type() != QEvent.Type.MouseButtonRelease)
        elif event.type() == QEvent.Type.WindowDeactivate:
            # whoever looks elsewhere lifts keys unseen
            self._hand.work(False)
        return False

    def _press(self, event: QKeyEvent) -> bool:
        hand, key = self._hand, event.key()
        match key:
            case Qt.Key.Key_PageUp:
                hand.advance(AHEAD_MM)
            case Qt.Key.Key_PageDown:
                hand.advance(-AHEAD_MM)
            case Qt.Key.Key_Home:
                hand.roll(TURN_DEG)
            case Qt.Key.Key_End:
                hand.roll(-TURN_DEG)
            case Qt.Key.Key_T | Qt.Key.Key_B | Qt.Key.Key_N | Qt.Key.Key_Z:
                if not event.isAutoRepeat():
                    self._do(Qt.Key(key), event.modifiers())
            case Qt.Key.Key_H:
                if not event.isAutoRepeat():
                    self._swap()
            case Qt.Key.Key_L:
                if not event.isAutoRepeat():
                    hand.wash()
                    self._notify("Washing the lens", "")
            case _:
                return False
        return True

    def _do(self, key: Qt.Key, modifiers: Qt.KeyboardModifier) -> None:
        if key == Qt.Key.Key_T:
            back = bool(modifiers & Qt.KeyboardModifier.ShiftModifier)
            self._choose(-1 if back else 1)
        elif key == Qt.Key.Key_B:
            self._hand.work(True)
        elif key == Qt.Key.Key_Z:
            self._hand.undo()
            self._notify("Undone", "The last cut was taken back, if there was one.")
        else:
            self.is_sucking = not self.is_sucking
            self._hand.suck(self.is_sucking)
            self._notify(f"Suction {'on' if self.is_sucking else 'off'}", "")

    def _swap(self) -> None:
        """Hold the scope and move the tool, or the other way round."""
        if not self._hand.swap():
            self._notify(
                "The scope cannot be held",
                "Take a tool first (T); a tool with a device of its own needs no hand.",
            )
        elif self._hand.holds_scope:
            self._notify("The scope is held", "Its controls move the tool; H: back.")
        else:
            self._notify("The scope moves", "The tool stays; T puts another one in.")

    def _choose(self, step: int) -> None:
        names = self.names
        place = names.index(self._hand.tool or NO_TOOL)
        self.take(names[(place + step) % len(names)])

    def take(self, name: str) -> None:
        """Take a tool, or put the one in hand away."""
        self._hand.choose(name)
        self._notify(name.capitalize() or "No tool in hand", tool_use(name))
