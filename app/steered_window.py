"""`paravol train`, operated by a hand at the mouse that needs no eyes.

A tool is taken, an assistant lays the scope for it, and the tool is led from place to
place about the picture's middle, rests there and bites. All of it goes to the window as
events of Qt, as a mouse's do.
"""

import math
import sys
import threading
import time
from itertools import count
from pathlib import Path

from PySide6.QtCore import QCoreApplication, QEvent, QObject, QPointF, Qt, QTimer
from PySide6.QtGui import QKeyEvent, QMouseEvent
from PySide6.QtWidgets import QApplication

from app.__main__ import main
from app.window.main_window import MainWindow
from app.window.panels.endoscope_panel import PictureView

STEP_S = 0.02
LOOKED_S, TAKEN_S, LAID_S = 1.0, 3.0, 12.0
"""From the first picture until a tool is taken, the assistant is asked, and until the
tool works."""

PLACES, RADIUS_SHARE = 7, 0.15
"""How many there are, and how far off the middle, of the picture's width."""

PLACE_S, LED_S, BITTEN_S = 3.0, 1.0, 2.0
"""How long it is at a place, is led there at first, and when the button goes down."""


class Hand(QObject):
    """Send keys and the mouse to a picture, step by step; ends with it."""

    def __init__(self, view: PictureView) -> None:
        super().__init__(view)
        self._view = view
        self._steps = count()
        self._is_held = False
        timer = QTimer(self)
        timer.timeout.connect(self._step)
        timer.start(round(STEP_S * 1e3))

    def _step(self) -> None:
        at_s = next(self._steps) * STEP_S
        for key, due_s in ((Qt.Key.Key_T, LOOKED_S), (Qt.Key.Key_R, TAKEN_S)):
            if at_s <= due_s < at_s + STEP_S:
                self._press(key)
        if at_s < LAID_S:
            return
        place_s = at_s % PLACE_S
        led = at_s // PLACE_S + min(place_s / LED_S, 1.0)
        turn = 2 * math.pi * led * 3 / PLACES
        reach = RADIUS_SHARE * min(self._view.width(), self._view.height())
        middle = QPointF(self._view.rect().center())
        place = middle + QPointF(reach * math.cos(turn), reach * math.sin(turn))
        self._send(QEvent.Type.MouseMove, place, Qt.MouseButton.NoButton)
        is_held = place_s > BITTEN_S
        if is_held != self._is_held:
            self._is_held = is_held
            kinds = QEvent.Type.MouseButtonRelease, QEvent.Type.MouseButtonPress
            self._send(kinds[is_held], place, Qt.MouseButton.LeftButton)

    def _press(self, key: Qt.Key) -> None:
        window = self._view.window()
        assert isinstance(window, MainWindow)
        # without a window manager no window is active: the page has the keyboard
        page = window.page
        for kind in (QEvent.Type.KeyPress, QEvent.Type.KeyRelease):
            event = QKeyEvent(kind, key, Qt.KeyboardModifier.NoModifier)
            QCoreApplication.sendEvent(page.focusWidget() or page, event)

    def _send(self, kind: QEvent.Type, place: QPointF, button: Qt.MouseButton) -> None:
        held = Qt.MouseButton.LeftButton if self._is_held else Qt.MouseButton.NoButton
        on_screen = self._view.mapToGlobal(place)
        bare = Qt.KeyboardModifier.NoModifier
        event = QMouseEvent(kind, place, on_screen, button, held, bare)
        QCoreApplication.sendEvent(self._view, event)


def wait_and_operate(record: Path) -> None:
    """Wait in a thread of its own until a flight is recorded; begin in the window's."""
    while not isinstance(application := QApplication.instance(), QApplication):
        time.sleep(STEP_S)
    while not record.exists():
        time.sleep(STEP_S)
    QTimer.singleShot(0, application, lambda: begin(application))


def begin(application: QApplication) -> None:
    """Put a hand to the picture that is shown."""
    shown = (w for w in application.allWidgets() if w.isVisible())
    view = next(widget for widget in shown if isinstance(widget, PictureView))
    Hand(view)


if __name__ == "__main__":
    place = Path(sys.argv[sys.argv.index("--record") + 1])
    threading.Thread(target=wait_and_operate, args=(place,), daemon=True).start()
    sys.exit(main(["train", *sys.argv[1:]]))
