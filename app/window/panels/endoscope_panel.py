"""The endoscope's picture in the window, with what is said on top of it."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QPointF, QRect, QRectF, Qt, Signal
from PySide6.QtGui import (
    QColor,
    QFontMetricsF,
    QImage,
    QPainter,
    QPaintEvent,
    QPen,
    QPolygonF,
)
from PySide6.QtWidgets import QSizePolicy, QWidget

from app.window.panels.guide_marks import (
    paint_guide,
    paint_names,
    paint_words,
    place_in,
    say_beside,
)
from app.window.panels.qt_image import image_of
from app.window.panels.result_card import paint_result, panel_colour
from app.window.panels.side_marks import paint_heading, paint_letters, paint_place
from app.window.scaling import Scaled, hold
from app.window.style import OVER, font_of
from app.window.texts import tr
from paravol.feedback.hazard_pointer import HazardPointer
from paravol.flight.flight_events import FlightEnd
from paravol.guide import GuideMark, NameMark
from paravol.slices.side_letters import SideLetter

LEAST_PX = 150
"""Smallest edge of the picture, at the designed size."""

_MARGIN = 14.0
_CENTRED = int(
    Qt.AlignmentFlag.AlignHCenter | Qt.AlignmentFlag.AlignTop | Qt.TextFlag.TextWordWrap
)


class PictureView(QWidget, Scaled):
    """Show the newest picture as large as there is room, and a message below."""

    changed = Signal()
    """Something else is to be painted; a second window then shows it, too."""

    def __init__(self) -> None:
        super().__init__()
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
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
        self._pointed = "", QColor(OVER.ink)
        self._letters: tuple[SideLetter, ...] = ()
        self._towards = ""
        self._heading: tuple[float, float] | None = None
        self._names: tuple[NameMark, ...] = ()
        self._guide: GuideMark | None = None
        self._tip: tuple[float, float] | None = None
        self._tip_words = ""
        self._result: FlightEnd | None = None
        hold(self, setMinimumWidth=LEAST_PX, setMinimumHeight=LEAST_PX)

    @property
    def edge_px(self) -> int:
        """Return the edge of the picture on the screen, in the screen's pixels."""
        return round(picture_square(self.rect()).width() * self.devicePixelRatioF())

    def _renew(self) -> None:
        self.update()
        self.changed.emit()

    def show_result(self, end: FlightEnd) -> None:
        """Put a flight's result over the picture, to stay."""
        self._result = end
        self._renew()

    def show_picture(self, pixels: NDArray[np.uint8]) -> None:
        """Show a ``(h, w, 3)`` uint8 sRGB picture."""
        self._image = image_of(pixels)
        self._renew()

    def mark_sides(self, letters: Sequence[SideLetter], towards: str) -> None:
        """Say which side of the patient is where, and which one the scope looks to."""
        self._letters = tuple(letters)
        self._towards = towards

    def mark_heading(self, place: tuple[float, float] | None) -> None:
        """Mark where the shaft goes, in shares of the picture; None to leave it out.

        A place out of view is marked at the rim.
        """
        self._heading = place

    def guide_to(self, guide: GuideMark | None, names: Sequence[NameMark] = ()) -> None:
        """Show the way to the task's place, and the names of what is seen."""
        self._guide = guide
        self._names = tuple(names)

    @property
    def guide(self) -> GuideMark | None:
        """Return the mark of the way that is painted; None without one."""
        return self._guide

    def mark_tip(self, place: tuple[float, float] | None, words: str = "") -> None:
        """Mark where the tool works, in shares of the picture; None for no tool.

        A place out of view is marked by an arrow at the rim. words: beside it.
        """
        self._tip, self._tip_words = place, words

    def point_at(
        self, pointer: HazardPointer | None, words: str, colour: QColor
    ) -> None:
        """Point at the nearest hazard, behind what hides it; None to leave it out.

        words: what to say of it. colour: of the line.
        """
        self._pointer = pointer
        self._pointed = words, colour

    def say(self, message: str, detail: str = "", share: float | None = None) -> None:
        """Put a message over the picture; `share` of 0 to 1 draws a bar under it."""
        if (message, detail, share) != (self._message, self._detail, self._share):
            self._message, self._detail, self._share = message, detail, share
            self._renew()

    @property
    def message(self) -> str:
        """Return the message over the picture; "" for none."""
        return self._message

    def warn(self, alarm: str, touched: str = "") -> None:
        """Put a red ring and a word round the picture; an empty word takes it off.

        touched: what the scope merely touches, said without a ring.
        """
        self._alarm = alarm
        self._touched = touched

    def mark_recording(self, is_recording: bool) -> None:
        """Show that the session is being recorded."""
        self._is_recording = is_recording
        self._renew()

    def paintEvent(self, event: QPaintEvent) -> None:
        """Paint picture, ring and message."""
        painter = QPainter(self)
        self.paint(painter, self.rect(), self.scale)
        painter.end()

    def paint(self, painter: QPainter, room: QRect, scale: float) -> None:
        """Paint all of it into a room, of this widget or another; scale: of texts."""
        painter.fillRect(room, Qt.GlobalColor.black)
        square = picture_square(room)
        if not self._image.isNull():
            painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform)
            painter.drawImage(square, self._image)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        if not self._image.isNull():
            paint_letters(painter, square, self._letters, scale, is_round=True)
            if self._heading is not None:
                paint_heading(painter, square, self._heading, scale)
            paint_names(painter, square, self._names, scale)
            if self._guide is not None and self._result is None:
                paint_guide(painter, square, self._guide, scale)
            if self._tip is not None:
                paint_place(painter, square, self._tip, scale, OVER.ready)
                if self._tip_words:
                    paint_words(painter, square, self._tip, self._tip_words, scale)
        if self._pointer is not None:
            self._paint_pointer(painter, square, self._pointer, scale)
        if self._alarm:
            _paint_alarm(painter, square, scale)
            _paint_corner(painter, room, scale, OVER.alarm, f"▲ {self._alarm}")
        elif self._touched:
            _paint_corner(
                painter,
                room,
                scale,
                OVER.ink,
                tr("touching: {touched}", touched=self._touched),
            )
        if self._towards and not self._image.isNull():
            _paint_towards(
                painter, room, scale, tr("looks to {towards}", towards=self._towards)
            )
        if self._result is not None:
            paint_result(painter, room, self._result, scale)
        if self._message:
            self._paint_message(painter, room, scale)
        if self._is_recording:
            corner = QPointF(room.topLeft())
            painter.setPen(Qt.PenStyle.NoPen)
            painter.setBrush(OVER.alarm)
            middle = corner + QPointF(26.0, 28.0) * scale
            painter.drawEllipse(middle, 6.0 * scale, 6.0 * scale)
            painter.setPen(OVER.ink)
            painter.setFont(font_of(11, scale, bold=True))
            painter.drawText(corner + QPointF(40.0, 33.0) * scale, "REC")

    def _paint_pointer(
        self, painter: QPainter, square: QRectF, pointer: HazardPointer, scale: float
    ) -> None:
        """Mark the hazard by a diamond, with a line from the tool's tip."""
        words, colour = self._pointed
        half = 9.0 * scale
        end = place_in(square, *pointer.end)
        corners = ((half, 0.0), (0.0, half), (-half, 0.0), (0.0, -half))
        diamond = QPolygonF([end + QPointF(*corner) for corner in corners])
        painter.setBrush(Qt.BrushStyle.NoBrush)
        # dark below: tissue is as bright as any colour
        for ink, width in ((QColor(0, 0, 0, 160), 5.0), (QColor(colour), 2.5)):
            painter.setPen(QPen(ink, width * scale))
            if pointer.begin is not None:
                painter.drawLine(place_in(square, *pointer.begin), end)
            painter.drawPolygon(diamond)
        say_beside(painter, square, end, words, scale, 1.5 * half / scale)

    def message_box(self, room: QRect, scale: float) -> tuple[QRectF, QRectF, QRectF]:
        """Return the box of the message in a room, and within it title and detail.

        Long texts take more lines.
        """
        side, edge = 16.0 * scale, 28.0 * scale
        width = min(room.width() - 48.0 * scale, 600.0 * scale)
        inner = QRectF(0.0, 0.0, width - 2.0 * side, 1e4)
        large = QFontMetricsF(font_of(16, scale, bold=True))
        small = QFontMetricsF(font_of(11, scale))
        title = large.boundingRect(inner, _CENTRED, self._message).height()
        detail = small.boundingRect(inner, _CENTRED, self._detail).height()
        height = 12.0 * scale + title + 4.0 * scale + detail + 14.0 * scale
        if self._share is not None:
            height += 16.0 * scale
        box = QRectF(
            room.left() + (room.width() - width) / 2,
            room.bottom() + 1 - height - edge,
            width,
            height,
        )
        inner.moveTo(box.left() + side, box.top() + 12.0 * scale)
        inner.setHeight(title)
        below = QRectF(inner.bottomLeft(), inner.size()).translated(0.0, 4.0 * scale)
        below.setHeight(detail)
        return box, inner, below

    def _paint_message(self, painter: QPainter, room: QRect, scale: float) -> None:
        box, title, detail = self.message_box(room, scale)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(panel_colour())
        painter.drawRoundedRect(box, 12.0 * scale, 12.0 * scale)
        painter.setFont(font_of(16, scale, bold=True))
        painter.setPen(OVER.ink)
        painter.drawText(title, _CENTRED, self._message)
        painter.setFont(font_of(11, scale))
        painter.setPen(OVER.quiet)
        painter.drawText(detail, _CENTRED, self._detail)
        if self._share is not None:
            inset, thick = 24.0 * scale, 5.0 * scale
            bar = QRectF(
                box.left() + inset,
                box.bottom() - 18.0 * scale,
                box.width() - 2.0 * inset,
                thick,
            )
            painter.setPen(Qt.PenStyle.NoPen)
            painter.setBrush(OVER.edge)
            painter.drawRoundedRect(bar, thick / 2, thick / 2)
            bar.setWidth(bar.width() * min(max(self._share, 0.0), 1.0))
            painter.setBrush(OVER.ready)
            painter.drawRoundedRect(bar, thick / 2, thick / 2)


def picture_square(room: QRect) -> QRectF:
    """Return where the round picture lies in a room.

    It begins at whole pixels: one as large as its place is then copied, not scaled.
    """
    side = max(min(room.width(), room.height()) - 2 * _MARGIN, 1.0)
    left = room.left() + (room.width() - side) // 2
    return QRectF(left, room.top() + (room.height() - side) // 2, side, side)


def _paint_alarm(painter: QPainter, square: QRectF, scale: float) -> None:
    inset = 3.0 * scale
    painter.setPen(QPen(OVER.alarm, 2.0 * inset))
    painter.setBrush(Qt.BrushStyle.NoBrush)
    painter.drawEllipse(square.adjusted(inset, inset, -inset, -inset))


def _paint_corner(
    painter: QPainter, room: QRect, scale: float, colour: QColor, words: str
) -> None:
    """Write into the upper right corner, beside the letter in the middle."""
    painter.setFont(font_of(16, scale, bold=True))
    painter.setPen(colour)
    corner = room.adjusted(0, round(18 * scale), round(-24 * scale), 0)
    corner.setLeft(room.center().x() + round(24 * scale))
    top_right = Qt.AlignmentFlag.AlignTop | Qt.AlignmentFlag.AlignRight
    painter.drawText(corner, int(top_right) | int(Qt.TextFlag.TextWordWrap), words)


def _paint_towards(painter: QPainter, room: QRect, scale: float, words: str) -> None:
    """Say in a lower corner where the scope looks: no letter at the rim can."""
    painter.setFont(font_of(9.5, scale, bold=True))
    painter.setPen(OVER.quiet)
    corner = room.adjusted(round(14 * scale), 0, 0, round(-12 * scale))
    bottom_left = Qt.AlignmentFlag.AlignBottom | Qt.AlignmentFlag.AlignLeft
    painter.drawText(corner, int(bottom_left), words)
