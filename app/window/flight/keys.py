"""Keys and mouse that steer, on their way from the page to the controls."""

import time
from collections.abc import Callable
from functools import partial

from PySide6.QtCore import QEvent, QObject, QPointF, Slot
from PySide6.QtGui import QMouseEvent, QWheelEvent
from PySide6.QtWidgets import QWidget

from app.window.keyboard.actions import STEERING, Act
from app.window.keyboard.key_map import KEYS
from app.window.keyboard.page_commands import Command, Commands
from devices.controls.keyboard import MouseKeys

_NOTCH = 120.0
"""Qt counts eighths of a degree; a notch of a wheel is fifteen degrees."""


class HandEvents(QObject):
    """Pass keys and a picture's mouse on to the controls of a scope."""

    def __init__(
        self, controls: MouseKeys, picture: QWidget, is_pointing: Callable[[], bool]
    ) -> None:
        """Listen; is_pointing: a tool has the mouse, whose right button tilts then."""
        super().__init__(picture)
        self._controls = controls
        self._is_pointing = is_pointing
        self._last = QPointF()
        KEYS.changed.connect(self._take_feel)
        self._take_feel()
        picture.installEventFilter(self)

    @Slot()
    def _take_feel(self) -> None:
        self._controls.feel = KEYS.feel

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Take what belongs to the scope; let the rest pass."""
        now = time.monotonic()
        match event:
            case QWheelEvent():
                self._controls.wheel(event.angleDelta().y() / _NOTCH, now)
                return True
            case QMouseEvent():
                return self._take_mouse(event, now)
        if event.type() == QEvent.Type.WindowDeactivate:
            self._controls.release(now)
        return False

    def commands(self) -> Commands:
        """Return what steers while its key is held."""
        key = self._key
        return {
            act: Command(partial(key, act, True), partial(key, act, False))
            for act in STEERING
        }

    def _key(self, act: Act, is_down: bool) -> None:
        self._controls.key(act, is_down, time.monotonic())

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
