"""A flight's result, painted over the last picture."""

from PySide6.QtCore import QRect, QRectF, Qt
from PySide6.QtGui import QColor, QFontMetricsF, QPainter

from app.window.style import INK, PANEL, QUIET, font_of
from paravol.flight import FlightEnd

CLOSE_HINT = "Q closes the window."

_WIDTH = 620.0
_MARGIN = 20.0


def panel_colour() -> QColor:
    """Return the ground of what is written over the picture."""
    colour = QColor(PANEL)
    colour.setAlphaF(0.9)
    return colour


def paint_result(painter: QPainter, room: QRect, end: FlightEnd, scale: float) -> None:
    """Paint title, figures and where the recording is, in the middle of the room."""
    flag = Qt.AlignmentFlag
    width = min(_WIDTH * scale, room.width() - _MARGIN * scale)
    inner = width - 2.0 * _MARGIN * scale
    wrapped = int(flag.AlignLeft | flag.AlignTop | Qt.TextFlag.TextWordWrap)
    anywhere = int(flag.AlignLeft | flag.AlignTop | Qt.TextFlag.TextWrapAnywhere)
    large, plain = font_of(16, scale, bold=True), font_of(11, scale)
    metrics = QFontMetricsF(plain)
    name_width = 0.47 * inner
    text_width = inner - name_width - 8.0 * scale

    def tall(width: float, text: str, flags: int = wrapped) -> float:
        return metrics.boundingRect(QRectF(0.0, 0.0, width, 1e4), flags, text).height()

    rows = [
        (name, text, max(tall(name_width, name), tall(text_width, text)))
        for name, text in end.rows()
    ]
    gap = 3.0 * scale
    where = end.where()
    where_height = tall(inner, where, anywhere)
    title_height = QFontMetricsF(large).height() + 2.0 * gap
    height = title_height + sum(high + gap for _, _, high in rows)
    height += 4.0 * gap + where_height + gap + metrics.height()
    box = QRectF(0.0, 0.0, width, height + 2.0 * _MARGIN * scale)
    box.moveCenter(QRectF(room).center())
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(panel_colour())
    painter.drawRoundedRect(box, 12.0 * scale, 12.0 * scale)
    left, top = box.left() + _MARGIN * scale, box.top() + _MARGIN * scale
    painter.setFont(large)
    painter.setPen(QColor(INK))
    painter.drawText(QRectF(left, top, inner, title_height), wrapped, end.title)
    top += title_height
    painter.setFont(plain)
    for name, text, high in rows:
        painter.setPen(QColor(QUIET))
        painter.drawText(QRectF(left, top, name_width, high), wrapped, name)
        painter.setPen(QColor(INK))
        at = QRectF(left + inner - text_width, top, text_width, high)
        painter.drawText(at, wrapped, text)
        top += high + gap
    top += 4.0 * gap
    painter.setPen(QColor(QUIET))
    painter.drawText(QRectF(left, top, inner, where_height), anywhere, where)
    top += where_height + gap
    painter.drawText(
        QRectF(left, top, inner, metrics.height()), int(flag.AlignLeft), CLOSE_HINT
    )
