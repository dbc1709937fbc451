"""Keys and mouse of the second hand: which tool it holds, and what it does with it."""

from collections.abc import Callable
from functools import partial

from PySide6.QtCore import QEvent, QObject, Qt
from PySide6.QtGui import QMouseEvent, QWheelEvent
from PySide6.QtWidgets import QWidget

from app.window.keyboard.actions import Act
from app.window.keyboard.key_map import KEYS
from app.window.keyboard.page_commands import Command, Commands, Notify
from app.window.panels.endoscope_panel import picture_square
from app.window.texts import later, tr
from paravol.inputs.instrument_controller import InstrumentController
from scenarios.instrument_state import NO_TOOL
from scenarios.instruments import INSTRUMENTS, Action

AHEAD_MM, TURN_DEG = 1.0, 15.0
"""Steps of a key that is pressed or held, and of a notch of the wheel."""

_NOTCH = 120.0
"""Qt counts eighths of a degree; a notch of a wheel is fifteen degrees."""

_USES = {
    Action.BITE: later("Hold the left button or {work}: its jaws close and bite."),
    Action.POWERED: later(
        "{suction} turns its suction on; hold the left button or {work}: it cuts."
    ),
    Action.SCRAPE: later("Hold the left button or {work} and move: it scrapes."),
    Action.CUT: later("Hold the left button or {work} and move: it cuts."),
    Action.INJECT: later(
        "Put its tip into the mucosa; hold the left button or {work}: it injects."
    ),
    Action.FEEL: later("It takes nothing."),
    Action.SUCK: later("{suction} turns its suction on and off."),
}


def tool_use(name: str) -> str:
    """Return how a tool of the catalogue is used, in words."""
    if name == NO_TOOL:
        return tr("The second hand is free.")
    said = _USES[INSTRUMENTS[name].action]
    use = tr(said, work=KEYS.label(Act.WORK), suction=KEYS.label(Act.SUCTION))
    where = tr("It goes where the mouse points; the wheel moves it deeper.")
    return f"{where} {use}"


class ToolKeys(QObject):
    """Pass keys and a picture's mouse to the second hand.

    The mouse is the tool's from when one is taken, until it is given to the scope. Its
    right button, and its wheel with Ctrl, are the scope's at all times.
    """

    def __init__(
        self,
        hand: InstrumentController,
        picture: QWidget,
        notify: Notify,
        *,
        is_steered: bool,
    ) -> None:
        """Listen to the picture's mouse.

        is_steered: the mouse is the scope's where it is not the tool's.
        """
        super().__init__(picture)
        self._hand = hand
        self._notify = notify
        self._is_steered = is_steered
        picture.setMouseTracking(True)
        self.is_sucking = False
        picture.installEventFilter(self)

    @property
    def names(self) -> tuple[str, ...]:
        """Return the tools that may be taken, the empty hand first."""
        return NO_TOOL, *(self._hand.tools or INSTRUMENTS)

    @property
    def has_control(self) -> bool:
        """Return whether what moves the scope moves the tool now."""
        return self.is_pointing() if self._is_steered else self._hand.holds_scope

    def is_pointing(self) -> bool:
        """Return whether the mouse is the tool's."""
        return self._hand.is_pointing

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Take what belongs to the second hand; let the rest pass."""
        match event:
            case QMouseEvent() if isinstance(watched, QWidget):
                return self._take_mouse(watched, event)
            case QWheelEvent() if self.is_pointing() and not event.modifiers():
                self._hand.advance(event.angleDelta().y() / _NOTCH * AHEAD_MM)
                return True
        if event.type() == QEvent.Type.WindowDeactivate:
            # whoever looks elsewhere lifts keys unseen
            self._hand.work(False)
        return False

    def commands(self) -> Commands:
        """Return what can be done."""
        hand = self._hand

        def again(do: Callable[[float], None], how: float) -> Command:
            return Command(partial(do, how), repeats=True)

        return {
            Act.TOOL_AHEAD: again(hand.advance, AHEAD_MM),
            Act.TOOL_BACK: again(hand.advance, -AHEAD_MM),
            Act.TOOL_LEFT: again(hand.roll, TURN_DEG),
            Act.TOOL_RIGHT: again(hand.roll, -TURN_DEG),
            Act.NEXT_TOOL: Command(partial(self._choose, 1)),
            Act.PREVIOUS_TOOL: Command(partial(self._choose, -1)),
            Act.WORK: Command(lambda: hand.work(True), lambda: hand.work(False)),
            Act.UNDO: Command(self._undo),
            Act.SUCTION: Command(self._suck),
            Act.WASH: Command(self._wash),
            Act.HOLD: Command(self._swap),
        }

    def _take_mouse(self, picture: QWidget, event: QMouseEvent) -> bool:
        square = picture_square(picture.rect())
        off = event.position() - square.center()
        radius = square.width() / 2.0
        is_up = event.type() == QEvent.Type.MouseButtonRelease
        if event.type() == QEvent.Type.MouseMove:
            self._hand.point(off.x() / radius, -off.y() / radius)
            return self.is_pointing() and not event.buttons() & KEYS.turning_button
        if event.button() == Qt.MouseButton.MiddleButton:
            # a stroke goes on to the scope: a blade cuts while it is dragged
            self._hand.work(not is_up)
        elif event.button() != KEYS.turning_button and self.is_pointing():
            self._hand.work(not is_up)
            return not is_up
        return False

    def _undo(self) -> None:
        self._hand.undo()
        self._notify(tr("Undone"), tr("The last cut was taken back, if there was one."))

    def _suck(self) -> None:
        self.is_sucking = not self.is_sucking
        self._hand.suck(self.is_sucking)
        self._notify(tr("Suction on") if self.is_sucking else tr("Suction off"), "")

    def _wash(self) -> None:
        self._hand.wash()
        self._notify(tr("Washing the lens"), "")

    def _swap(self) -> None:
        """Give what moves the scope to the tool, or back."""
        hold, key = KEYS.label(Act.HOLD), KEYS.label(Act.NEXT_TOOL)
        if self._hand.tool in (None, NO_TOOL):
            self._notify(
                tr("There is no tool in hand"), tr("{key} takes one.", key=key)
            )
        elif self._is_steered:
            self._hand.let_point(not self.is_pointing())
            if self.is_pointing():
                self._notify(
                    tr("The mouse moves the tool"), tr("{key}: the scope.", key=hold)
                )
            else:
                self._notify(
                    tr("The mouse moves the scope"), tr("{key}: the tool.", key=hold)
                )
        elif not self._hand.swap():
            self._notify(
                tr("The scope cannot be held"),
                tr("A tool with a device of its own needs no hand."),
            )
        elif self._hand.holds_scope:
            self._notify(
                tr("The scope is held"),
                tr("Its controls move the tool; {hold}: back.", hold=hold),
            )
        else:
            self._notify(
                tr("The scope moves"),
                tr("The tool stays; {next_tool} puts another one in.", next_tool=key),
            )

    def _choose(self, step: int) -> None:
        names = self.names
        place = names.index(self._hand.tool or NO_TOOL)
        self.take(names[(place + step) % len(names)])

    def take(self, name: str) -> None:
        """Take a tool, or put the one in hand away."""
        self._hand.choose(name)
        self._hand.let_point(True)
        self._notify(tr(name.capitalize() or "No tool in hand"), tool_use(name))
