"""Keys and mouse that steer, on their way from the window to the controls."""

import time
from collections.abc import Callable

from PySide6.QtCore import QEvent, QObject, QPointF, Slot
from PySide6.QtGui import QKeyEvent, QMouseEvent, QWheelEvent
from PySide6.QtWidgets import QWidget

from app.window.keyboard.actions import STEERING
from app.window.keyboard.key_map import KEYS
from devices.controls.keyboard import MouseKeys

_NOTCH = 120.0
"""Qt counts eighths of a degree; a notch of a wheel is fifteen degrees."""


class HandEvents(QObject):
    """Pass a window's keys and a picture's mouse on to the controls of a scope."""

    def __init__(
        self,
        controls: MouseKeys,
        window: QWidget,
        picture: QWidget,
        is_pointing: Callable[[], bool],
    ) -> None:
        """Listen; is_pointing: a tool has the mouse, whose right button tilts then."""
        super().__init__(window)
        self._controls = controls
        self._is_pointing = is_pointing
        self._window = window
        self._last = QPointF()
        KEYS.changed.connect(self._take_feel)
        self._take_feel()
        window.installEventFilter(self)
        picture.installEventFilter(self)

    @Slot()
    def _take_feel(self) -> None:
        self._controls.feel = KEYS.feel

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Take what belongs to the scope; let the rest pass."""
        now = time.monotonic()
        match event:
            case QKeyEvent() if watched is self._window:
                return self._take_key(event, now)
            case QWheelEvent() if watched is not self._window:
                self._controls.wheel(event.angleDelta().y() / _NOTCH, now)
                return True
            case QMouseEvent() if watched is not self._window:
                return self._take_mouse(event, now)
        if event.type() == QEvent.Type.WindowDeactivate:
            self._controls.release(now)
        return False

    def _take_key(self, event: QKeyEvent, now: float) -> bool:
        act = KEYS.action(event)
        if act not in STEERING or event.type() == QEvent.Type.ShortcutOverride:
            return False
        is_down = event.type() == QEvent.Type.KeyPress
        return event.isAutoRepeat() or self._controls.key(act, is_down, now)

    def _take_mouse(self, event: QMouseEvent, now: float) -> bool:
        position = event.position()
        moved = position - self._last
        self._last = position
        buttons = event.buttons()
        if event.type() != QEvent.Type.MouseMove or not buttons:
            return False
        is_turning = bool(buttons & KEYS.turning_button)
        rolls = is_turning and not self._is_pointing()
        self._controls.drag(moved.x(), moved.y(), rolls, now)
        return True
