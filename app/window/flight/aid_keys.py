"""Commands of what helps to find the way: where to go, and what is seen, by name."""

from collections.abc import Callable

from PySide6.QtCore import QPointF
from PySide6.QtGui import QCursor
from PySide6.QtWidgets import QWidget

from app.window.flight.flight_thread import FlightThread
from app.window.keyboard.actions import Act
from app.window.keyboard.key_map import KEYS
from app.window.keyboard.page_commands import Command, Commands, Notify
from app.window.panels.endoscope_panel import picture_square
from app.window.texts import tr
from scenarios.instrument_state import NO_TOOL


class AidKeys:
    """Switch the guide, lay the scope, name what is seen while a key is held."""

    def __init__(
        self,
        thread: FlightThread,
        picture: QWidget,
        notify: Notify,
        switched: Callable[[bool], object],
    ) -> None:
        """Prepare; switched: hears whether the guide is on."""
        self._thread = thread
        self._picture = picture
        self._notify = notify
        self._switched = switched
        self._has_tasks = bool(thread.flight.order.scenario.tasks)

    @property
    def has_guide(self) -> bool:
        """Return whether the way is shown."""
        return self._has_tasks and self._thread.guide.is_on

    def follow(self) -> None:
        """Name what is below the mouse now, if names are shown."""
        if self._thread.names_at is not None:
            self._thread.names_at = self._below_mouse()

    def commands(self) -> Commands:
        """Return what can be done in this flight."""
        found = {Act.NAMES: Command(self._show_names, self._hide_names)}
        if self._has_tasks:
            found[Act.GUIDE] = Command(self._switch_guide)
        if self._thread.flight.order.input.can_lay:
            found[Act.ASSIST] = Command(self._lay_scope)
        return found

    def _show_names(self) -> None:
        self._thread.names_at = self._below_mouse()

    def _hide_names(self) -> None:
        self._thread.names_at = None

    def _switch_guide(self) -> None:
        is_on = not self._thread.guide.is_on
        self._thread.guide_by(is_on)
        self._switched(is_on)
        if is_on:
            told = tr("The arrow leads to the task's place.")
        else:
            told = tr("{guide} shows it again.", guide=KEYS.label(Act.GUIDE))
        self._notify(tr("Way shown") if is_on else tr("Way hidden"), told)

    def _lay_scope(self) -> None:
        frame = self._thread.last
        if frame is None:
            return
        if self._thread.lay_scope(frame):
            self._notify(tr("The assistant looks for a place"), "")
        elif frame.tool.name == NO_TOOL:
            key = KEYS.label(Act.NEXT_TOOL)
            self._notify(
                tr("There is no tool in hand"), tr("{key} takes one.", key=key)
            )
        else:
            self._notify(tr("No tool is needed now"), "")

    def tell_laid(self, is_found: bool, other: str) -> None:
        """Say whether there is a place for the scope, and what other tool has one."""
        if is_found:
            self._notify(tr("The assistant lays the scope"), "")
        else:
            self._notify(
                tr("From nowhere this tool gets there"),
                tr("The {tool} does.", tool=tr(other)) if other else "",
            )

    def _below_mouse(self) -> tuple[float, float]:
        """Return the mouse's place in the picture, in shares; else its middle."""
        square = picture_square(self._picture.rect())
        off = QPointF(self._picture.mapFromGlobal(QCursor.pos())) - square.topLeft()
        x, y = off.x() / square.width(), off.y() / square.height()
        is_in = (x - 0.5) ** 2 + (y - 0.5) ** 2 <= 0.25
        return (x, y) if is_in else (0.5, 0.5)
