"""Keys and mouse of the second hand: which tool it holds, and what it does with it."""

from collections.abc import Callable

from PySide6.QtCore import QEvent, QObject, Qt
from PySide6.QtGui import QKeyEvent, QMouseEvent
from PySide6.QtWidgets import QWidget

from app.window.keyboard.actions import Act
from app.window.keyboard.key_map import KEYS
from app.window.texts import later, tr
from paravol.inputs.operating_hand import OperatingHand
from scenarios.instrument_state import NO_TOOL
from scenarios.instruments import INSTRUMENTS, Action

_ONCE = {
    *(Act.NEXT_TOOL, Act.PREVIOUS_TOOL, Act.WORK, Act.UNDO),
    *(Act.SUCTION, Act.WASH, Act.HOLD),
}
"""What a key that is held does not do again."""

AHEAD_MM, TURN_DEG = 1.0, 15.0
"""Steps of a key that is pressed or held."""

_USES = {
    Action.BITE: later("Hold {work}: its jaws close and bite."),
    Action.POWERED: later("{suction} turns its suction on; hold {work}: it cuts."),
    Action.SCRAPE: later("Hold {work} and drag: it scrapes."),
    Action.CUT: later("Hold {work} and drag: it cuts."),
    Action.INJECT: later("Put its tip into the mucosa; hold {work}: it injects."),
    Action.FEEL: later("It takes nothing."),
    Action.SUCK: later("{suction} turns its suction on and off."),
}


def tool_use(name: str) -> str:
    """Return how a tool of the catalogue is used, in words."""
    if name == NO_TOOL:
        return tr("The second hand is free.")
    said = _USES[INSTRUMENTS[name].action]
    return tr(said, work=KEYS.label(Act.WORK), suction=KEYS.label(Act.SUCTION))


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
                case QEvent.Type.KeyRelease if KEYS.action(event) is Act.WORK:
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
        hand, act = self._hand, KEYS.action(event)
        match act:
            case Act.TOOL_AHEAD:
                hand.advance(AHEAD_MM)
            case Act.TOOL_BACK:
                hand.advance(-AHEAD_MM)
            case Act.TOOL_LEFT:
                hand.roll(TURN_DEG)
            case Act.TOOL_RIGHT:
                hand.roll(-TURN_DEG)
            case _ if act in _ONCE:
                if not event.isAutoRepeat():
                    self._do(act)
            case _:
                return False
        return True

    def _do(self, act: Act) -> None:
        match act:
            case Act.NEXT_TOOL:
                self._choose(1)
            case Act.PREVIOUS_TOOL:
                self._choose(-1)
            case Act.WORK:
                self._hand.work(True)
            case Act.UNDO:
                self._hand.undo()
                self._notify(
                    tr("Undone"), tr("The last cut was taken back, if there was one.")
                )
            case Act.SUCTION:
                self.is_sucking = not self.is_sucking
                self._hand.suck(self.is_sucking)
                self._notify(
                    tr("Suction on") if self.is_sucking else tr("Suction off"), ""
                )
            case Act.WASH:
                self._hand.wash()
                self._notify(tr("Washing the lens"), "")
            case Act.HOLD:
                self._swap()

    def _swap(self) -> None:
        """Hold the scope and move the tool, or the other way round."""
        if not self._hand.swap():
            key = KEYS.label(Act.NEXT_TOOL)
            self._notify(
                tr("The scope cannot be held"),
                tr(
                    "Take a tool first ({key}); a tool with a device of its "
                    "own needs no hand.",
                    key=key,
                ),
            )
        elif self._hand.holds_scope:
            self._notify(
                tr("The scope is held"),
                tr(
                    "Its controls move the tool; {hold}: back.",
                    hold=KEYS.label(Act.HOLD),
                ),
            )
        else:
            self._notify(
                tr("The scope moves"),
                tr(
                    "The tool stays; {next_tool} puts another one in.",
                    next_tool=KEYS.label(Act.NEXT_TOOL),
                ),
            )

    def _choose(self, step: int) -> None:
        names = self.names
        place = names.index(self._hand.tool or NO_TOOL)
        self.take(names[(place + step) % len(names)])

    def take(self, name: str) -> None:
        """Take a tool, or put the one in hand away."""
        self._hand.choose(name)
        self._notify(tr(name.capitalize() or "No tool in hand"), tool_use(name))
