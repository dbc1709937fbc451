"""Keys of what is shown: help, which view is large, a second screen, slices."""

from collections.abc import Callable
from typing import Protocol

from PySide6.QtCore import QEvent, QObject, Qt
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QWidget

from app.window.panels.slices_panel import SlicesView

VIEW_KEYS = {
    "F1 ?": "these keys",
    "F2": "settings: theme, size of texts",
    "F3": "the scope's picture on a second screen",
    "F4": "large: scope, slices, overview",
    "F": "full screen",
    "C": "open the head; drag turns it, wheel zooms",
}

SLICE_KEYS = {
    "M": "CT, MR, both",
    "F5": "stay at a place; follow the scope",
    "F6": "choose axial, coronal, sagittal",
    "F7": "bone, soft tissue, air to bone",
    "Ctrl ← →": "contrast: narrow, wide window",
    "Ctrl ↑ ↓": "brighter, darker",
    "Alt ← → ↑ ↓": "move the place",
    "Alt Pg↑ Pg↓": "through the slices",
    "Click": "look a place up; twice: follow",
    "Right drag": "contrast and brightness",
    "Wheel": "through the slices",
}

WINDOW_STEP_HU = 50.0
PLACE_STEP = 2.0
"""Voxels of a key that moves the place."""

_WAYS = {
    Qt.Key.Key_Left: (-1, 0),
    Qt.Key.Key_Right: (1, 0),
    Qt.Key.Key_Up: (0, -1),
    Qt.Key.Key_Down: (0, 1),
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
    """Pass a window's keys on to what it shows. Install it after all that share keys.

    Arrows belong to it only with Ctrl or Alt.
    """

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
        modifiers = event.modifiers()
        if modifiers & Qt.KeyboardModifier.ControlModifier:
            return self._change_window(Qt.Key(event.key()))
        if modifiers & Qt.KeyboardModifier.AltModifier:
            return self._move(Qt.Key(event.key()))
        match event.key():
            case Qt.Key.Key_F1 | Qt.Key.Key_Question:
                self._views.switch_help()
            case Qt.Key.Key_F3:
                self._views.switch_second_screen()
            case Qt.Key.Key_F4:
                self._views.switch_large()
            case Qt.Key.Key_F5:
                self._notify(self._slices.switch_following(), self._slices.info)
            case Qt.Key.Key_F6:
                self._notify(self._slices.next_plane(), "Keys go through these slices.")
            case Qt.Key.Key_F7:
                self._notify(self._slices.next_window(), "")
            case _:
                return False
        return True

    def _change_window(self, key: Qt.Key) -> bool:
        if key not in _WAYS:
            return False
        right, down = _WAYS[key]
        told = self._slices.change_window(
            WINDOW_STEP_HU * right, -WINDOW_STEP_HU / 2 * down
        )
        self._notify(told, "")
        return True

    def _move(self, key: Qt.Key) -> bool:
        match key:
            case Qt.Key.Key_PageUp:
                self._slices.step(1)
            case Qt.Key.Key_PageDown:
                self._slices.step(-1)
            case _ if key in _WAYS:
                right, down = _WAYS[key]
                self._slices.nudge(PLACE_STEP * right, PLACE_STEP * down)
            case _:
                return False
        return True
