"""Marks of the way in a picture, and names of what is seen there."""

import math
from collections.abc import Iterable

from PySide6.QtCore import QPointF, QRect, QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPen, QPolygonF

from app.window.panels.result_card import panel_colour
from app.window.style import OVER, font_of
from app.window.texts import tr
from paravol.guide import GuideMark, NameMark

GUIDE = "#56b4e9"
"""Of Okabe and Ito's palette; what a shape says no colour says alone."""

RIM = 0.42
"""Words stand so far from the picture's middle at most, in shares of its width."""

_DARK = QColor(0, 0, 0, 160)
"""Below every line: tissue is as bright as any colour."""


def paint_guide(
    painter: QPainter, square: QRectF, mark: GuideMark, scale: float
) -> None:
    """Show where to go: a ring at the goal, a line to the next point, or an arrow.

    square: that the round picture fills.
    """
    painter.save()
    painter.setBrush(Qt.BrushStyle.NoBrush)
    if not mark.is_in_picture:
        _paint_arrow(painter, square, mark, scale)
    elif mark.is_goal:
        _paint_goal(painter, square, mark, scale)
    else:
        _paint_next(painter, square, mark, scale)
    painter.restore()


def paint_names(
    painter: QPainter, square: QRectF, names: Iterable[NameMark], scale: float
) -> None:
    """Write names beside their places; what would lie over another is left out."""
    painter.save()
    taken: list[QRectF] = []
    for name in names:
        place = place_in(square, name.x, name.y)
        box = _box(painter, square, place, tr(name.name), scale, 6.0)
        if any(box.intersects(other) for other in taken):
            continue
        taken.append(box)
        painter.setPen(QPen(_DARK, 5.0 * scale))
        painter.drawPoint(place)
        painter.setPen(QPen(QColor(OVER.ink), 3.0 * scale))
        painter.drawPoint(place)
        _write(painter, box, tr(name.name), scale)
    painter.restore()


def paint_words(
    painter: QPainter,
    square: QRectF,
    at: tuple[float, float],
    words: str,
    scale: float,
) -> None:
    """Write words beside a place, which is in shares of the picture's square."""
    x, y = at[0] - 0.5, at[1] - 0.5
    # what is out of view is told within the picture's rim
    inwards = min(RIM / max(math.hypot(x, y), 1e-9), 1.0)
    painter.save()
    place = place_in(square, 0.5 + inwards * x, 0.5 + inwards * y)
    say_beside(painter, square, place, words, scale, 14.0)
    painter.restore()


def _paint_goal(
    painter: QPainter, square: QRectF, mark: GuideMark, scale: float
) -> None:
    """Ring the goal; the ring closes as the task is done."""
    place, half = place_in(square, mark.x, mark.y), 13.0 * scale
    for ink, width in ((_DARK, 4.5), (QColor(GUIDE), 2.0)):
        painter.setPen(QPen(ink, width * scale))
        painter.drawEllipse(place, half, half)
    if mark.progress > 0.0:
        painter.setPen(QPen(QColor(OVER.ready), 4.0 * scale))
        round_ = QRectF(place.x() - half, place.y() - half, 2.0 * half, 2.0 * half)
        painter.drawArc(round_, 90 * 16, -round(360 * 16 * min(mark.progress, 1.0)))
    painter.setPen(QPen(QColor(GUIDE), 3.0 * scale))
    painter.drawPoint(place)
    say_beside(
        painter, square, place, f"{tr(mark.what)} · {tr(mark.text())}", scale, 18.0
    )


def _paint_next(
    painter: QPainter, square: QRectF, mark: GuideMark, scale: float
) -> None:
    """Draw a line to the next point of the way, with a head of an arrow there."""
    place, middle = place_in(square, mark.x, mark.y), square.center()
    way = place - middle
    length, half = math.hypot(way.x(), way.y()), 8.0 * scale
    along = way / length if length > 2.0 * half else QPointF(0.0, -1.0)
    aside = QPointF(-along.y(), along.x())
    head = QPolygonF(
        [place - (along + aside) * half, place, place - (along - aside) * half]
    )
    for ink, width in ((_DARK, 4.5), (QColor(GUIDE), 2.0)):
        pen = QPen(ink, width * scale)
        painter.setPen(pen)
        painter.drawPolyline(head)
        if length > 2.0 * half:
            pen.setStyle(Qt.PenStyle.DashLine)
            painter.setPen(pen)
            painter.drawLine(middle, place)
    say_beside(painter, square, place, tr(mark.text()), scale, 14.0)


def _paint_arrow(
    painter: QPainter, square: QRectF, mark: GuideMark, scale: float
) -> None:
    """Draw an arrow at the rim, towards what lies out of the picture."""
    x, y = mark.x - 0.5, mark.y - 0.5
    length = max(math.hypot(x, y), 1e-9)
    along = QPointF(x / length, y / length)
    aside, half = QPointF(-along.y(), along.x()), 11.0 * scale
    tip = square.center() + along * (square.width() / 2 - 10.0 * scale)
    foot = tip - along * 1.8 * half
    painter.setPen(QPen(_DARK, 2.5 * scale))
    painter.setBrush(QColor(GUIDE))
    painter.drawPolygon(QPolygonF([foot - aside * half, tip, foot + aside * half]))
    text = (
        tr(mark.text()) if not mark.is_goal else f"{tr(mark.what)} · {tr(mark.text())}"
    )
    say_beside(painter, square, foot - along * half, text, scale, 8.0)


def place_in(square: QRectF, x: float, y: float) -> QPointF:
    """Return a place that is told in shares of the picture's square."""
    return QPointF(
        square.left() + x * square.width(), square.top() + y * square.height()
    )


def say_beside(
    painter: QPainter,
    square: QRectF,
    place: QPointF,
    words: str,
    scale: float,
    off: float,
) -> None:
    """Write words beside a place, so far off it, within the picture's square."""
    _write(painter, _box(painter, square, place, words, scale, off), words, scale)


def _box(
    painter: QPainter,
    square: QRectF,
    place: QPointF,
    words: str,
    scale: float,
    off: float,
) -> QRectF:
    """Return where words stand beside a place, within the picture's square.

    In several rows where they are longer than half of it.
    """
    painter.setFont(font_of(10, scale, bold=True))
    most = QRect(0, 0, round(square.width() / 2), round(square.height()))
    flags = int(Qt.TextFlag.TextWordWrap)
    needed = painter.fontMetrics().boundingRect(most, flags, words)
    width, height = needed.width() + 14.0 * scale, needed.height() + 5.0 * scale
    left, middle = place.x() + off * scale, place.y()
    if left + width > square.right():
        left = place.x() - off * scale - width
    if left < square.left():
        # neither side has room: below, or above
        left = max(min(place.x() - width / 2.0, square.right() - width), square.left())
        down = off * scale + height / 2.0
        middle += down if middle + down + height < square.bottom() else -down
    top = min(max(middle - height / 2.0, square.top()), square.bottom() - height)
    return QRectF(left, top, width, height)


def _write(painter: QPainter, box: QRectF, words: str, scale: float) -> None:
    painter.setFont(font_of(10, scale, bold=True))
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(panel_colour())
    painter.drawRoundedRect(box, 4.0 * scale, 4.0 * scale)
    painter.setBrush(Qt.BrushStyle.NoBrush)
    painter.setPen(QColor(OVER.ink))
    flags = int(Qt.AlignmentFlag.AlignCenter) | int(Qt.TextFlag.TextWordWrap)
    painter.drawText(box, flags, words)
