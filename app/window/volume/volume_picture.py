"""The picture of a scan; it is turned by the mouse or the arrow keys."""

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QPointF, QRectF, QSize, Qt, Signal
from PySide6.QtGui import (
    QColor,
    QImage,
    QKeyEvent,
    QMouseEvent,
    QPainter,
    QPaintEvent,
    QResizeEvent,
    QWheelEvent,
)
from PySide6.QtWidgets import QSizePolicy, QWidget

from app.window.panels.qt_image import image_of
from app.window.scaling import Scaled
from app.window.style import BACKGROUND, INK, QUIET, font_of
from app.window.texts import tr
from paravol.volume.orbit import Orbit

_DEG_PER_PX = 0.4
_STEP_DEG = 5.0
_NOTCH, _PER_NOTCH = 120.0, 1.15
_KEYS = {
    Qt.Key.Key_Left: (-1, 0),
    Qt.Key.Key_Right: (1, 0),
    Qt.Key.Key_Up: (0, 1),
    Qt.Key.Key_Down: (0, -1),
}


class VolumePicture(QWidget, Scaled):
    """Show the newest picture; say how it shall be seen."""

    turned = Signal(object, bool)
    """The `Orbit`, and whether it still moves."""
    resized = Signal()

    def __init__(self) -> None:
        super().__init__()
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setAccessibleName(tr("Picture of the scan"))
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self.setMinimumSize(QSize(240, 240))
        self.setAttribute(Qt.WidgetAttribute.WA_OpaquePaintEvent)
        self._image = QImage()
        self._said = ""
        self._orbit: Orbit | None = None
        self._last: QPointF | None = None

    @property
    def image(self) -> QImage:
        """Return what is shown."""
        return self._image

    def start(self, orbit: Orbit) -> None:
        """Stand somewhere; `turned` tells of moves only."""
        self._orbit = orbit

    def show_picture(self, pixels: NDArray[np.uint8]) -> None:
        """Show a picture ``(h, w, 3)`` uint8 sRGB, as large as there is room."""
        self._image = image_of(pixels)
        self.update()

    def say(self, words: str) -> None:
        """Write something below the picture."""
        if words != self._said:
            self._said = words
            self.update()

    def _turn(self, orbit: Orbit, is_moving: bool) -> None:
        self._orbit = orbit
        self.turned.emit(orbit, is_moving)
        self.update()

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Take hold."""
        self._last = event.position()

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Turn; the right or middle button shifts."""
        if self._last is None or self._orbit is None:
            return
        moved = event.position() - self._last
        self._last = event.position()
        if event.buttons() & Qt.MouseButton.LeftButton:
            orbit = self._orbit.turned(
                -moved.x() * _DEG_PER_PX, moved.y() * _DEG_PER_PX
            )
        else:
            high = max(self.height(), 1)
            orbit = self._orbit.shifted(-moved.x() / high, moved.y() / high)
        self._turn(orbit, True)

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """Let go; what was quick is drawn fine."""
        self._last = None
        if self._orbit is not None:
            self._turn(self._orbit, False)

    def wheelEvent(self, event: QWheelEvent) -> None:
        """Come nearer, or go back."""
        if self._orbit is not None:
            notches = event.angleDelta().y() / _NOTCH
            self._turn(self._orbit.nearer(_PER_NOTCH**notches), False)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Turn by arrows, shift with Shift, come nearer with plus."""
        if self._orbit is None:
            super().keyPressEvent(event)
            return
        key = Qt.Key(event.key())
        if key in _KEYS:
            right, up = _KEYS[key]
            if event.modifiers() & Qt.KeyboardModifier.ShiftModifier:
                self._turn(self._orbit.shifted(0.05 * right, 0.05 * up), False)
            else:
                turned = self._orbit.turned(_STEP_DEG * right, _STEP_DEG * up)
                self._turn(turned, False)
        elif key in (Qt.Key.Key_Plus, Qt.Key.Key_Equal):
            self._turn(self._orbit.nearer(_PER_NOTCH), False)
        elif key == Qt.Key.Key_Minus:
            self._turn(self._orbit.nearer(1.0 / _PER_NOTCH), False)
        else:
            super().keyPressEvent(event)

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Have the picture drawn at the new size."""
        super().resizeEvent(event)
        self.resized.emit()

    def paintEvent(self, event: QPaintEvent) -> None:
        """Paint the picture, the letters of the sides, and what is said."""
        painter = QPainter(self)
        painter.fillRect(self.rect(), QColor(BACKGROUND))
        if not self._image.isNull():
            painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform)
            painter.drawImage(QRectF(self.rect()), self._image)
        scale = self.scale
        if self._orbit is not None:
            painter.setFont(font_of(16, scale, bold=True))
            painter.setPen(QColor(INK))
            room = self.rect().adjusted(round(12 * scale), 0, round(-12 * scale), 0)
            flag, middle = Qt.AlignmentFlag, Qt.AlignmentFlag.AlignVCenter
            left, right = self._orbit.letters()
            painter.drawText(room, int(middle | flag.AlignLeft), left)
            painter.drawText(room, int(middle | flag.AlignRight), right)
        painter.setFont(font_of(10, scale))
        painter.setPen(QColor(QUIET))
        inset = round(10 * scale)
        foot = self.rect().adjusted(inset, inset, -inset, -inset)
        painter.drawText(foot, int(Qt.AlignmentFlag.AlignBottom), self._said)
        painter.end()
