"""The endoscope's picture in the window, with what is said on top of it."""

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QPointF, QRectF, QSize, Qt
from PySide6.QtGui import QColor, QImage, QPainter, QPaintEvent, QPen, QPolygonF
from PySide6.QtWidgets import QSizePolicy, QWidget

from app.window.panels.qt_image import image_of
from app.window.panels.result_card import paint_result, panel_colour
from app.window.style import ALARM, INK, QUIET, READY, font_of
from paravol.feedback.hazard_pointer import HazardPointer
from paravol.flight import FlightEnd

_MARGIN = 14.0


class PictureView(QWidget):
    """Show the newest picture as large as there is room, and a message below."""

    def __init__(self) -> None:
        super().__init__()
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self.setMinimumSize(QSize(240, 240))
        # Everything is painted here, every time: nothing to erase before.
        self.setAttribute(Qt.WidgetAttribute.WA_OpaquePaintEvent)
        self._image = QImage()
        self._message = ""
        self._detail = ""
        self._share: float | None = None
        self._alarm = ""
        self._touched = ""
        self._is_recording = False
        self._pointer: HazardPointer | None = None
        self._pointed = "", INK
        self._result: FlightEnd | None = None
        self._scale = 1.0

    def set_scale(self, scale: float) -> None:
        """Scale the text; 1 is the designed size."""
        self._scale = scale
        self.update()

    def show_result(self, end: FlightEnd) -> None:
        """Put a flight's result over the picture, to stay."""
        self._result = end
        self.update()

    def show_picture(self, pixels: NDArray[np.uint8]) -> None:
        """Show a ``(h, w, 3)`` uint8 sRGB picture."""
        self._image = image_of(pixels)
        self.update()

    def point_at(self, pointer: HazardPointer | None, words: str, colour: str) -> None:
        """Point at the nearest hazard, behind what hides it; None to leave it out.

        words: what to say of it. colour: of the line.
        """
        self._pointer = pointer
        self._pointed = words, colour

    def say(self, message: str, detail: str = "", share: float | None = None) -> None:
        """Put a message over the picture; `share` of 0 to 1 draws a bar under it."""
        if (message, detail, share) != (self._message, self._detail, self._share):
            self._message, self._detail, self._share = message, detail, share
            self.update()

    def warn(self, alarm: str, touched: str = "") -> None:
        """Put a red ring and a word round the picture; an empty word takes it off.

        touched: what the scope merely touches, said without a ring.
        """
        self._alarm = alarm
        self._touched = touched

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
        if self._pointer is not None:
            self._paint_pointer(painter, square, self._pointer)
        if self._alarm:
            self._paint_alarm(painter, square)
        elif self._touched:
            self._paint_corner(painter, INK, f"touching: {self._touched}")
        if self._result is not None:
            paint_result(painter, self.rect(), self._result, self._scale)
        if self._message:
            self._paint_message(painter)
        if self._is_recording:
            scale = self._scale
            painter.setPen(Qt.PenStyle.NoPen)
            painter.setBrush(QColor(ALARM))
            painter.drawEllipse(QPointF(26.0, 28.0) * scale, 6.0 * scale, 6.0 * scale)
            painter.setPen(QColor(INK))
            painter.setFont(font_of(11, scale, bold=True))
            painter.drawText(QPointF(40.0, 33.0) * scale, "REC")
        painter.end()

    def _paint_pointer(
        self, painter: QPainter, square: QRectF, pointer: HazardPointer
    ) -> None:
        """Mark the hazard by a diamond, with a line from the tool's tip."""
        words, colour = self._pointed
        half = 9.0 * self._scale

        def place(shares: tuple[float, float]) -> QPointF:
            x, y = shares
            return QPointF(
                square.left() + x * square.width(), square.top() + y * square.height()
            )

        end = place(pointer.end)
        corners = ((half, 0.0), (0.0, half), (-half, 0.0), (0.0, -half))
        diamond = QPolygonF([end + QPointF(*corner) for corner in corners])
        painter.setBrush(Qt.BrushStyle.NoBrush)
        # dark below: tissue is as bright as any colour
        for ink, width in ((QColor(0, 0, 0, 160), 5.0), (QColor(colour), 2.5)):
            painter.setPen(QPen(ink, width * self._scale))
            if pointer.begin is not None:
                painter.drawLine(place(pointer.begin), end)
            painter.drawPolygon(diamond)
        painter.setFont(font_of(10, self._scale, bold=True))
        width = painter.fontMetrics().horizontalAdvance(words) + 2.0 * half
        height = 2.2 * half
        left = end.x() + 1.5 * half
        if left + width > square.right():
            left = end.x() - 1.5 * half - width
        box = QRectF(left, end.y() - height / 2.0, width, height)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(panel_colour())
        painter.drawRoundedRect(box, 4.0 * self._scale, 4.0 * self._scale)
        painter.setPen(QColor(INK))
        painter.drawText(box, int(Qt.AlignmentFlag.AlignCenter), words)

    def _paint_alarm(self, painter: QPainter, square: QRectF) -> None:
        scale = self._scale
        inset = 3.0 * scale
        painter.setPen(QPen(QColor(ALARM), 2.0 * inset))
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.drawEllipse(square.adjusted(inset, inset, -inset, -inset))
        self._paint_corner(painter, ALARM, f"▲ {self._alarm}")

    def _paint_corner(self, painter: QPainter, colour: str, words: str) -> None:
        scale = self._scale
        painter.setFont(font_of(16, scale, bold=True))
        painter.setPen(QColor(colour))
        corner = self.rect().adjusted(0, round(18 * scale), round(-24 * scale), 0)
        painter.drawText(
            corner,
            int(Qt.AlignmentFlag.AlignTop | Qt.AlignmentFlag.AlignRight),
            words,
        )

    def _paint_message(self, painter: QPainter) -> None:
        scale = self._scale
        width, height = min(self.width() - 48.0 * scale, 600.0 * scale), 74.0 * scale
        if self._share is not None:
            height += 16.0 * scale
        box = QRectF(
            (self.width() - width) / 2,
            self.height() - height - 28.0 * scale,
            width,
            height,
        )
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(panel_colour())
        painter.drawRoundedRect(box, 12.0 * scale, 12.0 * scale)
        centre = int(Qt.AlignmentFlag.AlignHCenter | Qt.AlignmentFlag.AlignTop)
        side = 16.0 * scale
        painter.setFont(font_of(16, scale, bold=True))
        painter.setPen(QColor(INK))
        painter.drawText(
            box.adjusted(side, 12.0 * scale, -side, 0), centre, self._message
        )
        painter.setFont(font_of(11, scale))
        painter.setPen(QColor(QUIET))
        painter.drawText(
            box.adjusted(side, 43.0 * scale, -side, 0), centre, self._detail
        )
        if self._share is not None:
            inset, thick = 24.0 * scale, 5.0 * scale
            bar = QRectF(
                box.left() + inset,
                box.bottom() - 18.0 * scale,
                box.width() - 2.0 * inset,
                thick,
            )
            painter.setPen(Qt.PenStyle.NoPen)
            painter.setBrush(QColor("#30363d"))
            painter.drawRoundedRect(bar, thick / 2, thick / 2)
            bar.setWidth(bar.width() * min(max(self._share, 0.0), 1.0))
            painter.setBrush(QColor(READY))
            painter.drawRoundedRect(bar, thick / 2, thick / 2)
