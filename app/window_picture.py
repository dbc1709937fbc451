"""The endoscope's picture in the window, with what is said on top of it."""

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QPointF, QRectF, QSize, Qt
from PySide6.QtGui import QColor, QFont, QImage, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QSizePolicy, QWidget

from app.window_image import image_of
from app.window_style import ALARM, INK, PANEL, QUIET, READY

_MARGIN = 14.0


class PictureView(QWidget):
    """Show the newest picture as large as there is room, and a message below."""

    def __init__(self) -> None:
        super().__init__()
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self.setMinimumSize(QSize(320, 320))
        # Everything is painted here, every time: nothing to erase before.
        self.setAttribute(Qt.WidgetAttribute.WA_OpaquePaintEvent)
        self._image = QImage()
        self._message = ""
        self._detail = ""
        self._share: float | None = None
        self._alarm = ""
        self._is_recording = False

    def show_picture(self, pixels: NDArray[np.uint8]) -> None:
        """Show a ``(h, w, 3)`` uint8 sRGB picture."""
        self._image = image_of(pixels)
        self.update()

    def say(self, message: str, detail: str = "", share: float | None = None) -> None:
        """Put a message over the picture; `share` of 0 to 1 draws a bar under it."""
        if (message, detail, share) != (self._message, self._detail, self._share):
            self._message, self._detail, self._share = message, detail, share
            self.update()

    def warn(self, alarm: str) -> None:
        """Put a red ring and a word round the picture; an empty word takes it off."""
        self._alarm = alarm

    def mark_recording(self, is_recording: bool) -> None:
        """Show that the session is being recorded."""
        self._is_recording = is_recording
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        """Paint picture, ring and message."""
        painter = QPainter(self)
        painter.fillRect(self.rect(), Qt.GlobalColor.black)
        side = min(self.width(), self.height()) - 2 * _MARGIN
        square = QRectF(
            (self.width() - side) / 2, (self.height() - side) / 2, side, side
        )
        if not self._image.isNull():
            painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform)
            painter.drawImage(square, self._image)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        if self._alarm:
            self._paint_alarm(painter, square)
        if self._message:
            self._paint_message(painter)
        if self._is_recording:
            painter.setPen(Qt.PenStyle.NoPen)
            painter.setBrush(QColor(ALARM))
            painter.drawEllipse(QPointF(26.0, 28.0), 6.0, 6.0)
            painter.setPen(QColor(INK))
            painter.setFont(_font(11, bold=True))
            painter.drawText(QPointF(40.0, 33.0), "REC")
        painter.end()

    def _paint_alarm(self, painter: QPainter, square: QRectF) -> None:
        painter.setPen(QPen(QColor(ALARM), 6.0))
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.drawEllipse(square.adjusted(3.0, 3.0, -3.0, -3.0))
        painter.setFont(_font(16, bold=True))
        painter.setPen(QColor(ALARM))
        corner = self.rect().adjusted(0, 18, -24, 0)
        painter.drawText(
            corner,
            int(Qt.AlignmentFlag.AlignTop | Qt.AlignmentFlag.AlignRight),
            f"▲ {self._alarm}",
        )

    def _paint_message(self, painter: QPainter) -> None:
        width, height = min(self.width() - 48.0, 560.0), 74.0
        if self._share is not None:
            height += 16.0
        box = QRectF(
            (self.width() - width) / 2, self.height() - height - 28.0, width, height
        )
        panel = QColor(PANEL)
        panel.setAlphaF(0.88)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(panel)
        painter.drawRoundedRect(box, 12.0, 12.0)
        centre = int(Qt.AlignmentFlag.AlignHCenter | Qt.AlignmentFlag.AlignTop)
        painter.setFont(_font(16, bold=True))
        painter.setPen(QColor(INK))
        painter.drawText(box.adjusted(16, 12, -16, 0), centre, self._message)
        painter.setFont(_font(11))
        painter.setPen(QColor(QUIET))
        painter.drawText(box.adjusted(16, 43, -16, 0), centre, self._detail)
        if self._share is not None:
            bar = QRectF(box.left() + 24, box.bottom() - 18, box.width() - 48, 5)
            painter.setPen(Qt.PenStyle.NoPen)
            painter.setBrush(QColor("#30363d"))
            painter.drawRoundedRect(bar, 2.5, 2.5)
            bar.setWidth(bar.width() * min(max(self._share, 0.0), 1.0))
            painter.setBrush(QColor(READY))
            painter.drawRoundedRect(bar, 2.5, 2.5)


def _font(points: int, *, bold: bool = False) -> QFont:
    font = QFont()
    font.setPointSize(points)
    font.setBold(bold)
    return font
