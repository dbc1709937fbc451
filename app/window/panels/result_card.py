"""A flight's result, painted over the last picture."""

from bisect import bisect_right
from dataclasses import dataclass

from PySide6.QtCore import QRect, QRectF, Qt
from PySide6.QtGui import QColor, QFont, QFontMetricsF, QPainter

from app.window.style import OVER, font_of
from app.window.texts import later, tr
from paravol.flight.flight_events import FlightEnd

CLOSE_HINT = later("Q closes the window.")

SMALLEST = 0.75
"""A card that is too tall is written so much smaller, at most; smaller is not read."""

_WIDTH = 620.0
_MARGIN = 20.0
_FLAG = Qt.AlignmentFlag
_WRAPPED = int(_FLAG.AlignLeft | _FLAG.AlignTop | Qt.TextFlag.TextWordWrap)
_ANYWHERE = int(_FLAG.AlignLeft | _FLAG.AlignTop | Qt.TextFlag.TextWrapAnywhere)


def panel_colour() -> QColor:
    """Return the ground of what is written over the picture."""
    colour = QColor(OVER.panel)
    colour.setAlphaF(0.9)
    return colour


@dataclass(frozen=True, slots=True)
class ResultCard:
    """Place a result's rows in a box, in pixels.

    rows: names and texts; what has no room is left out, as the last one then says.
    """

    rows: list[tuple[str, str]]
    where: str
    box: QRectF
    scale: float

    @staticmethod
    def fitting(room: QRect, end: FlightEnd, scale: float) -> "ResultCard":
        """Return the card in the middle of the room, as large as fits, up to scale."""
        rows = [(tr(name), tr(text)) for name, text in end.rows()]
        where = tr(end.where())
        card = _laid_out(room, rows, where, scale)
        while card.box.height() > room.height() and card.scale > SMALLEST * scale:
            card = _laid_out(
                room, rows, where, max(card.scale - 0.05 * scale, SMALLEST * scale)
            )
        if card.box.height() <= room.height():
            return card

        def shortened(kept: int) -> ResultCard:
            more = tr(
                "{rows} more rows are printed when the window closes",
                rows=len(rows) - kept,
            )
            return _laid_out(room, [*rows[:kept], ("...", more)], where, card.scale)

        kept = bisect_right(
            range(1, len(rows)),
            False,
            key=lambda kept: shortened(kept).box.height() > room.height(),
        )
        return shortened(kept)

    @property
    def inner(self) -> float:
        """Return the width that is written on."""
        return self.box.width() - 2.0 * _MARGIN * self.scale

    @property
    def name_width(self) -> float:
        """Return the width of the names."""
        return 0.47 * self.inner

    @property
    def text_width(self) -> float:
        """Return the width of the texts beside them."""
        return self.inner - self.name_width - 8.0 * self.scale

    @property
    def gap(self) -> float:
        """Return the room between two rows."""
        return 3.0 * self.scale

    def fonts(self) -> tuple[QFont, QFont]:
        """Return those of the title and of everything else."""
        return font_of(16, self.scale, bold=True), font_of(11, self.scale)

    def tall(self, width: float, text: str, flags: int = _WRAPPED) -> float:
        """Return the height of a text in lines of a width."""
        metrics = QFontMetricsF(self.fonts()[1])
        return metrics.boundingRect(QRectF(0.0, 0.0, width, 1e4), flags, text).height()

    def row_height(self, name: str, text: str) -> float:
        """Return the height of a row."""
        return max(self.tall(self.name_width, name), self.tall(self.text_width, text))

    @property
    def title_height(self) -> float:
        """Return that of the title, with what is below it."""
        return QFontMetricsF(self.fonts()[0]).height() + 2.0 * self.gap

    def height(self) -> float:
        """Return what all of it takes, with its margins."""
        high = self.title_height
        high += sum(self.row_height(*row) + self.gap for row in self.rows)
        high += 5.0 * self.gap + self.tall(self.inner, self.where, _ANYWHERE)
        high += QFontMetricsF(self.fonts()[1]).height()
        return high + 2.0 * _MARGIN * self.scale


def _laid_out(
    room: QRect, rows: list[tuple[str, str]], where: str, scale: float
) -> ResultCard:
    """Return the card in the middle of the room, however tall it becomes."""
    width = min(_WIDTH * scale, room.width() - _MARGIN * scale)
    card = ResultCard(rows, where, QRectF(0.0, 0.0, width, 0.0), scale)
    card.box.setHeight(card.height())
    card.box.moveCenter(QRectF(room).center())
    return card


def paint_result(painter: QPainter, room: QRect, end: FlightEnd, scale: float) -> None:
    """Paint title, figures and where the recording is, in the middle of the room."""
    card = ResultCard.fitting(room, end, scale)
    scale, box, gap, inner = card.scale, card.box, card.gap, card.inner
    large, plain = card.fonts()
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(panel_colour())
    painter.drawRoundedRect(box, 12.0 * scale, 12.0 * scale)
    left, top = box.left() + _MARGIN * scale, box.top() + _MARGIN * scale
    painter.setFont(large)
    painter.setPen(OVER.ink)
    painter.drawText(
        QRectF(left, top, inner, card.title_height), _WRAPPED, tr(end.title)
    )
    top += card.title_height
    painter.setFont(plain)
    for name, text in card.rows:
        high = card.row_height(name, text)
        painter.setPen(OVER.quiet)
        painter.drawText(QRectF(left, top, card.name_width, high), _WRAPPED, name)
        painter.setPen(OVER.ink)
        at = QRectF(left + inner - card.text_width, top, card.text_width, high)
        painter.drawText(at, _WRAPPED, text)
        top += high + gap
    top += 4.0 * gap
    painter.setPen(OVER.quiet)
    where_height = card.tall(inner, card.where, _ANYWHERE)
    painter.drawText(QRectF(left, top, inner, where_height), _ANYWHERE, card.where)
    top += where_height + gap
    hint_height = QFontMetricsF(plain).height()
    painter.drawText(
        QRectF(left, top, inner, hint_height), int(_FLAG.AlignLeft), tr(CLOSE_HINT)
    )
