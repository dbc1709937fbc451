"""A hand at mouse and keyboard: strokes that tremble, overshoot and take their time.

Everything goes to the window as events of Qt, at the place below the pointer.
"""

import math
import random
from collections.abc import Callable

from PySide6.QtCore import QCoreApplication, QEvent, QPoint, QPointF, Qt
from PySide6.QtGui import QKeyEvent, QMouseEvent, QWheelEvent
from PySide6.QtWidgets import QApplication, QWidget

from app.window.main_window import MainWindow

STEP_S = 0.016
TREMOR_PX = 0.5
"""Of each step of a stroke, 1 sigma."""

OVERSHOOT = 0.12
"""A stroke is longer or shorter than meant by such a share, 1 sigma."""

FITTS_S, FITTS_PX_S = 0.12, 700.0
NOTCH = 120

Button = Qt.MouseButton


class Hand:
    """Move the mouse of one window, and press keys."""

    def __init__(
        self, window: MainWindow, rng: random.Random, wait: Callable[[float], None]
    ) -> None:
        self._window = window
        self._rng = rng
        self._wait = wait
        self._at = QPointF(window.width() / 2, window.height() / 2)
        self._held: QWidget | None = None
        self._buttons = Button.NoButton

    def point(self, widget: QWidget, x: float = 0.5, y: float = 0.5) -> None:
        """Move the pointer to a place of a widget, in shares of its size."""
        aim = QPointF(x * widget.width(), y * widget.height())
        top = widget.window()
        to = QPointF(widget.mapTo(top, aim.toPoint()))
        if top is not self._window:
            to = QPointF(self._window.mapFromGlobal(top.mapToGlobal(to.toPoint())))
        self._at = to

    def click(self, widget: QWidget, x: float = 0.5, y: float = 0.5) -> None:
        """Click on a place of a widget."""
        self.point(widget, x, y)
        self.press(Button.LeftButton)
        self._wait(0.06)
        self.release(Button.LeftButton)
        self._wait(0.1)

    def press(self, button: Button) -> None:
        """Press a button where the pointer is."""
        self._held = self._held or self._below()
        self._buttons |= button
        self._send(QEvent.Type.MouseButtonPress, button)

    def release(self, button: Button) -> None:
        """Let a button go."""
        self._buttons &= ~button
        self._send(QEvent.Type.MouseButtonRelease, button)
        if self._buttons == Button.NoButton:
            self._held = None

    def drag(
        self,
        right_px: float,
        down_px: float,
        button: Button = Button.LeftButton,
        *,
        is_held: bool = False,
    ) -> None:
        """Make a stroke with a button down, as well as a hand can.

        is_held: the button is down already and stays so.
        """
        stretch = 1.0 + self._rng.gauss(0.0, OVERSHOOT)
        length = math.hypot(right_px, down_px)
        steps = max(round((FITTS_S + length / FITTS_PX_S) / STEP_S), 2)
        if not is_held:
            self.press(button)
        done = 0.0
        for n in range(steps):
            t = (n + 1) / steps
            now = t * t * t * (10.0 - 15.0 * t + 6.0 * t * t)
            part, done = (now - done) * stretch, now
            self._at += QPointF(
                part * right_px + self._rng.gauss(0.0, TREMOR_PX),
                part * down_px + self._rng.gauss(0.0, TREMOR_PX),
            )
            self._send(QEvent.Type.MouseMove, Button.NoButton)
            self._wait(STEP_S)
        if not is_held:
            self.release(button)

    def glide(self, widget: QWidget, x: float, y: float) -> None:
        """Move the pointer over a widget to a place, in shares of its size."""
        begin = self._at
        self.point(widget, x, y)
        end = self._at
        way = end - begin
        length = math.hypot(way.x(), way.y())
        steps = max(round((FITTS_S + length / FITTS_PX_S) / STEP_S), 2)
        for n in range(steps):
            t = (n + 1) / steps
            now = t * t * t * (10.0 - 15.0 * t + 6.0 * t * t)
            shake = self._rng.gauss(0.0, TREMOR_PX), self._rng.gauss(0.0, TREMOR_PX)
            self._at = begin + way * now + QPointF(*shake)
            self._send(QEvent.Type.MouseMove, Button.NoButton)
            self._wait(STEP_S)

    def wheel(self, notches: int) -> None:
        """Turn the wheel; away from the hand for positive notches."""
        for _ in range(abs(notches)):
            below = self._held or self._below()
            event = QWheelEvent(
                self._in(below),
                QPointF(self._window.mapToGlobal(self._at.toPoint())),
                QPoint(),
                QPoint(0, NOTCH if notches > 0 else -NOTCH),
                self._buttons,
                Qt.KeyboardModifier.NoModifier,
                Qt.ScrollPhase.NoScrollPhase,
                False,
            )
            QCoreApplication.sendEvent(below, event)
            self._wait(0.05)

    def tap(self, key: Qt.Key, text: str = "") -> None:
        """Press a key shortly."""
        self.hold(key, 0.07, text)

    def hold(self, key: Qt.Key, time_s: float, text: str = "") -> None:
        """Hold a key down for a while."""
        self.key(key, is_down=True, text=text)
        self._wait(time_s)
        self.key(key, is_down=False, text=text)

    def key(self, key: Qt.Key, *, is_down: bool, text: str = "") -> None:
        """Put a key down, or up."""
        kind = QEvent.Type.KeyPress if is_down else QEvent.Type.KeyRelease
        # without a window manager no window is active: the page has the keyboard
        page = self._window.page
        target = QApplication.focusWidget() or page.focusWidget() or page
        none = Qt.KeyboardModifier.NoModifier
        QCoreApplication.sendEvent(target, QKeyEvent(kind, key, none, text))

    def _below(self) -> QWidget:
        popup = QApplication.activePopupWidget()
        if popup is not None:
            return popup
        return self._window.childAt(self._at.toPoint()) or self._window

    def _in(self, widget: QWidget) -> QPointF:
        place = self._window.mapToGlobal(self._at.toPoint())
        return QPointF(widget.mapFromGlobal(place)) + (
            self._at - QPointF(self._at.toPoint())
        )

    def _send(self, kind: QEvent.Type, button: Button) -> None:
        below = self._held or self._below()
        place = QPointF(self._window.mapToGlobal(self._at.toPoint()))
        none = Qt.KeyboardModifier.NoModifier
        event = QMouseEvent(kind, self._in(below), place, button, self._buttons, none)
        QCoreApplication.sendEvent(below, event)
