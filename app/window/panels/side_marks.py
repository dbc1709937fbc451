"""Letters at the rim of a picture: which side of the patient is where."""

from collections.abc import Iterable

from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QPainter

from app.window.style import OVER, font_of
from paravol.side_letters import SideLetter

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
