"""Mouse and keys of the camera that leaves the recorded view."""

from collections.abc import Callable

from PySide6.QtCore import QEvent, QObject, QPointF, Qt
from PySide6.QtGui import QMouseEvent, QWheelEvent
from PySide6.QtWidgets import QWidget

from paravol.sessions.free_camera import CameraMove

TURN_DEG = 0.2
"""For each pixel that the mouse is dragged."""

ASIDE_MM = 0.05
"""The same with the right button."""

WHEEL_MM, KEY_MM, KEY_ROLL_DEG = 1.0, 0.5, 5.0
_NOTCH = 120.0

MOVES = {
    "W": CameraMove(ahead_mm=KEY_MM),
    "S": CameraMove(ahead_mm=-KEY_MM),
    "A": CameraMove(right_mm=-KEY_MM),
    "D": CameraMove(right_mm=KEY_MM),
    "R": CameraMove(up_mm=KEY_MM),
    "F": CameraMove(up_mm=-KEY_MM),
    "Z": CameraMove(roll_deg=-KEY_ROLL_DEG),
    "X": CameraMove(roll_deg=KEY_ROLL_DEG),
}
"""Of keys, by their places, while one looks around."""


class LookEvents(QObject):
    """Turn a picture's mouse events into moves of the camera."""

    def __init__(self, picture: QWidget, look: Callable[[CameraMove], None]) -> None:
        """Listen to the picture; look: told of each move."""
        super().__init__(picture)
        self._picture = picture
        self._look = look
        self._last = QPointF()
        picture.installEventFilter(self)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Take what the mouse does on the picture."""
        if isinstance(event, QWheelEvent):
            notches = event.angleDelta().y() / _NOTCH
            self._look(CameraMove(ahead_mm=WHEEL_MM * notches))
            return True
        if not isinstance(event, QMouseEvent):
            return False
        moved = event.position() - self._last
        self._last = event.position()
        if event.type() != QEvent.Type.MouseMove or not event.buttons():
            return False
        if event.buttons() & Qt.MouseButton.RightButton:
            aside = CameraMove(
                right_mm=ASIDE_MM * moved.x(), up_mm=-ASIDE_MM * moved.y()
            )
            self._look(aside)
        else:
            turned = CameraMove(
                right_deg=TURN_DEG * moved.x(), up_deg=-TURN_DEG * moved.y()
            )
            self._look(turned)
        return True
