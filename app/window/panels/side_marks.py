"""Marks in a picture: the patient's sides as letters, and where the shaft goes."""

import math
from collections.abc import Iterable

from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPen, QPolygonF

from app.window.style import OVER, font_of
from paravol.slices.side_letters import SideLetter

_HALF = 10.0
"""Half the height of what a letter stands on, at the designed size."""


def paint_letters(
    painter: QPainter,
    room: QRectF,
    letters: Iterable[SideLetter],
    scale: float,
    *,
    is_round: bool,
) -> None:
    """Write letters along the rim of a picture that fills a room, inside it."""
    painter.setFont(font_of(10, scale, bold=True))
    half = _HALF * scale
    inner = room.adjusted(half, half, -half, -half).adjusted(2, 2, -2, -2)
    for side in letters:
        width = painter.fontMetrics().horizontalAdvance(side.letters) + half
        across, down = (inner.width() - width + half) / 2, inner.height() / 2
        if is_round:
            reach = min(across, down)
        else:
            # out to the frame
            reach = min(across / max(abs(side.x), 1e-9), down / max(abs(side.y), 1e-9))
        middle = inner.center() + QPointF(reach * side.x, reach * side.y)
        box = QRectF(middle.x() - width / 2, middle.y() - half, width, 2.0 * half)
        ground = QColor(OVER.background)
        ground.setAlphaF(0.75)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(ground)
        painter.drawRoundedRect(box, half, half)
        painter.setPen(QColor(OVER.ink))
        painter.drawText(box, int(Qt.AlignmentFlag.AlignCenter), side.letters)


def paint_heading(
    painter: QPainter, room: QRectF, place: tuple[float, float], scale: float
) -> None:
    """Mark where the shaft goes: a ring with four ticks, or an arrow at the rim."""
    paint_place(painter, room, place, scale, OVER.ink, has_ticks=True)


def paint_place(
    painter: QPainter,
    room: QRectF,
    place: tuple[float, float],
    scale: float,
    colour: QColor,
    *,
    has_ticks: bool = False,
) -> None:
    """Mark a place by a ring, or by an arrow at the rim where it is out of view.

    place: shares of the picture, which is round and fills the room; it may lie outside.
    """
    radius, half = room.width() / 2, 7.0 * scale
    aside = QPointF((place[0] - 0.5) * room.width(), (place[1] - 0.5) * room.height())
    away = math.hypot(aside.x(), aside.y())
    painter.save()
    painter.translate(room.center())
    painter.rotate(math.degrees(math.atan2(aside.y(), aside.x())))
    painter.setBrush(Qt.BrushStyle.NoBrush)
    # dark below: tissue is as bright as any colour
    for ink, width in ((QColor(0, 0, 0, 160), 4.0), (QColor(colour), 1.8)):
        painter.setPen(QPen(ink, width * scale))
        if away > radius - 2.0 * half:
            tip = radius - 1.5 * half
            arrow = ((tip - half, -half), (tip, 0.0), (tip - half, half))
            painter.drawPolyline(QPolygonF([QPointF(*corner) for corner in arrow]))
            continue
        painter.drawEllipse(QPointF(away, 0.0), half, half)
        if not has_ticks:
            continue
        for x, y in ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)):
            tick = QPointF(x, y) * half
            middle = QPointF(away, 0.0)
            painter.drawLine(middle + tick, middle + tick * 1.7)
    painter.restore()
