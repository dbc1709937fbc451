"""Keys of what is shown: help, which view is large, a second screen, slices."""

from collections.abc import Callable
from typing import Protocol

from PySide6.QtCore import QEvent, QObject
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QWidget

from app.window.keyboard.actions import Act
from app.window.keyboard.key_map import KEYS
from app.window.panels.slices_panel import SlicesView
from app.window.texts import tr

WINDOW_STEP_HU = 50.0
PLACE_STEP = 2.0
"""Voxels of a key that moves the place."""

_WINDOWS = {
    Act.NARROW: (-1, 0),
    Act.WIDE: (1, 0),
    Act.BRIGHTER: (0, -1),
    Act.DARKER: (0, 1),
}
_PLACES = {
    Act.PLACE_LEFT: (-1, 0),
    Act.PLACE_RIGHT: (1, 0),
    Act.PLACE_UP: (0, -1),
    Act.PLACE_DOWN: (0, 1),
}


class Views(Protocol):
    """What the keys do with a page."""

    def switch_help(self) -> None:
        """Show or hide the help."""

    def switch_large(self) -> None:
        """Make the next view large."""

    def switch_second_screen(self) -> None:
        """Show or hide the second screen's window."""


class ViewKeys(QObject):
    """Pass a window's keys on to what it shows."""

    def __init__(
        self,
        views: Views,
        slices: SlicesView,
        window: QWidget,
        notify: Callable[[str, str], None],
    ) -> None:
        """Listen to the window; notify: says a line and what it means."""
        super().__init__(window)
        self._views = views
        self._slices = slices
        self._notify = notify
        window.installEventFilter(self)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Take what belongs to the views; let the rest pass."""
        if not isinstance(event, QKeyEvent) or event.type() != QEvent.Type.KeyPress:
            return False
        match act := KEYS.action(event):
            case Act.HELP:
                self._views.switch_help()
            case Act.SECOND_SCREEN:
                self._views.switch_second_screen()
            case Act.LARGE:
                self._views.switch_large()
            case Act.FOLLOW:
                self._notify(self._slices.switch_following(), self._slices.info)
            case Act.PLANE:
                self._notify(
                    self._slices.next_plane(), tr("Keys go through these slices.")
                )
            case Act.WINDOW:
                self._notify(self._slices.next_window(), "")
            case Act.SLICE_AHEAD:
                self._slices.step(1)
            case Act.SLICE_BACK:
                self._slices.step(-1)
            case _ if act in _WINDOWS:
                right, down = _WINDOWS[act]
                told = self._slices.change_window(
                    WINDOW_STEP_HU * right, -WINDOW_STEP_HU / 2 * down
                )
                self._notify(told, "")
            case _ if act in _PLACES:
                right, down = _PLACES[act]
                self._slices.nudge(PLACE_STEP * right, PLACE_STEP * down)
            case _:
                return False
        return True
