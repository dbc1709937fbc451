"""Force and nearness under the picture: each a bar, a figure and a word."""

import time

from PySide6.QtCore import QPointF, QRectF, QSize, Qt
from PySide6.QtGui import QBrush, QColor, QPainter, QPaintEvent, QPen, QPolygonF
from PySide6.QtWidgets import QSizePolicy, QWidget

from app.window.scaling import Scaled, hold
from app.window.style import (
    CAUTION,
    COLOURS,
    EDGE,
    INK,
    PANEL,
    QUIET,
    WARNING,
    Colours,
    font_of,
)
from app.window.texts import tr
from paravol.feedback import NO_SIGNS, Strain, TouchSigns
from paravol.feedback.touch_signs import FULL_N, MARGIN_MM

HEIGHT = 52
"""At the designed size."""

TICKS_N = 5.0
"""Between two marks of the scale of force."""

HAZARD_SCALE_MM = 10.0
"""End of the scale of nearness."""

CAREFUL_MM = 1.0
"""So near a hazard the bar says so."""

BITE_S = 1.0
"""So long a bite is said."""

_PATTERNS = {
    Strain.NONE: Qt.BrushStyle.SolidPattern,
    Strain.LOW: Qt.BrushStyle.SolidPattern,
    Strain.HIGH: Qt.BrushStyle.BDiagPattern,
    Strain.BREAKING: Qt.BrushStyle.DiagCrossPattern,
    Strain.EXCESSIVE: Qt.BrushStyle.DiagCrossPattern,
}
"""Hatching of the bar of force: it and the colour each tell how near a break is."""

_ALARMING = Strain.BREAKING, Strain.EXCESSIVE


def _strain_colour(strain: Strain) -> QColor:
    if strain in _ALARMING:
        return WARNING
    return CAUTION if strain is Strain.HIGH else QUIET


def hazard_look(signs: TouchSigns, colours: Colours = COLOURS) -> tuple[QColor, str]:
    """Return colour and word of how near the nearest hazard is.

    colours: those of the window, or over pictures.
    """
    if not signs.is_near_hazard:
        return colours.quiet, ""
    if signs.hazard_mm < CAREFUL_MM:
        return colours.warning, tr("▲ close")
    return colours.caution, "near"


class TouchBars(QWidget, Scaled):
    """Show the force with the mark at which the wall breaks, and the nearest hazard."""

    def __init__(self) -> None:
        super().__init__()
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.setAttribute(Qt.WidgetAttribute.WA_OpaquePaintEvent)
        self._signs = NO_SIGNS
        self._sound = ""
        self._is_bite = False
        self._bite_until_s = 0.0
        hold(self, setFixedHeight=HEIGHT)

    def sizeHint(self) -> QSize:
        """Return the height that is needed; any width will do."""
        return QSize(240, round(HEIGHT * self.scale))

    def show_signs(self, signs: TouchSigns, sound: str = "") -> None:
        """Show these signs. sound: what to say of the sound, "" for nothing."""
        now = time.monotonic()
        if signs.bites > self._signs.bites:
            self._bite_until_s = now + BITE_S
        is_bite, self._is_bite = self._is_bite, now < self._bite_until_s
        if (signs, sound, is_bite) != (self._signs, self._sound, self._is_bite):
            self._signs, self._sound = signs, sound
            words = tr(
                "Force {force}. Hazard {hazard}.",
                force=tr(signs.force_text()),
                hazard=tr(signs.hazard_text()),
            )
            self.setAccessibleName(words)
            self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        """Paint both bars side by side."""
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.fillRect(self.rect(), PANEL)
        side, scale = 14.0 * self.scale, self.scale
        half = (self.width() - 3.0 * side) / 2.0
        place = QRectF(side, 0.0, half, HEIGHT * scale)
        self._paint_force(painter, place)
        place.translate(half + side, 0.0)
        self._paint_hazard(painter, place)
        painter.end()

    def _paint_force(self, painter: QPainter, place: QRectF) -> None:
        signs, scale = self._signs, self.scale
        colour, pattern = _strain_colour(signs.strain), _PATTERNS[signs.strain]
        word = "" if signs.strain is Strain.NONE else tr(signs.strain.value)
        sign = "▲ " if signs.strain in _ALARMING else ""
        words = [each for each in (sign + word, tr("bite") * self._is_bite) if each]
        self._words(
            painter,
            place,
            tr("Force"),
            tr(signs.force_text()),
            " · ".join(words),
            colour,
        )
        bar = self._bar(place)
        painter.fillRect(bar, EDGE)
        force = signs.force_n or 0.0
        if force > 0.0:
            full = QRectF(bar)
            full.setWidth(bar.width() * min(force / FULL_N, 1.0))
            if pattern is not Qt.BrushStyle.SolidPattern:
                # hatched on its own colour, darker: a pattern alone is thin
                painter.fillRect(full, colour.darker(200))
            painter.fillRect(full, QBrush(colour, pattern))
        for number in range(1, int(FULL_N / TICKS_N)):
            painter.setPen(QPen(PANEL, scale))
            x = bar.left() + bar.width() * number * TICKS_N / FULL_N
            painter.drawLine(QPointF(x, bar.top()), QPointF(x, bar.bottom()))
            self._number(painter, bar, x, f"{number * TICKS_N:g}")
        self._number(painter, bar, bar.right(), f"{FULL_N:g} N")
        if signs.limit_n is not None:
            share = min(signs.limit_n / FULL_N, 1.0)
            self._mark(painter, bar, bar.left() + bar.width() * share)

    def _paint_hazard(self, painter: QPainter, place: QRectF) -> None:
        """Paint a line from the tool to the hazard: as long as the way is."""
        signs, scale = self._signs, self.scale
        colour, word = hazard_look(signs)
        words = [each for each in (word, self._sound) if each]
        self._words(
            painter,
            place,
            tr("Hazard"),
            tr(signs.hazard_text()),
            " · ".join(words),
            colour,
        )
        bar = self._bar(place)
        painter.fillRect(bar, EDGE)
        margin = bar.left() + bar.width() * MARGIN_MM / HAZARD_SCALE_MM
        self._mark(painter, bar, margin)
        is_beyond = signs.hazard is None or signs.hazard_mm > HAZARD_SCALE_MM
        if not is_beyond or signs.hazard is None:
            self._number(
                painter,
                bar,
                bar.right(),
                f"{HAZARD_SCALE_MM:g} mm",
            )
        if signs.hazard is None:
            return
        way = min(max(signs.hazard_mm / HAZARD_SCALE_MM, 0.0), 1.0)
        tip = bar.left() + bar.width() * way
        middle, radius = bar.center().y(), bar.height() / 2.0
        painter.setPen(QPen(colour, 3.0 * scale))
        painter.drawLine(QPointF(bar.left(), middle), QPointF(tip - radius, middle))
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(colour)
        painter.drawRect(QRectF(bar.left(), bar.top(), 3.0 * scale, bar.height()))
        if is_beyond:
            # an arrow: the hazard lies beyond the scale
            back = tip - 2.0 * radius
            corners = (tip, middle), (back, bar.top()), (back, bar.bottom())
            painter.drawPolygon(QPolygonF([QPointF(*corner) for corner in corners]))
        else:
            painter.drawEllipse(QPointF(tip, middle), radius, radius)

    def _bar(self, place: QRectF) -> QRectF:
        scale = self.scale
        return QRectF(place.left(), 30.0 * scale, place.width(), 12.0 * scale)

    def _number(self, painter: QPainter, bar: QRectF, x: float, text: str) -> None:
        """Write a figure of the scale before its place, in the bar."""
        scale = self.scale
        painter.setFont(font_of(7, scale))
        painter.setPen(QUIET)
        room = QRectF(bar.left(), bar.top(), x - bar.left() - 3.0 * scale, bar.height())
        right = int(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
        painter.drawText(room, right, text)

    def _mark(self, painter: QPainter, bar: QRectF, x: float) -> None:
        """Mark a place of a bar by a line with a triangle on it."""
        scale = self.scale
        painter.setPen(QPen(INK, 2.0 * scale))
        painter.drawLine(QPointF(x, bar.top()), QPointF(x, bar.bottom()))
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(INK)
        half, low = 4.0 * scale, bar.bottom() + 6.0 * scale
        corners = (x, bar.bottom()), (x - half, low), (x + half, low)
        painter.drawPolygon(QPolygonF([QPointF(*corner) for corner in corners]))

    def _words(
        self,
        painter: QPainter,
        place: QRectF,
        caption: str,
        figure: str,
        word: str,
        colour: QColor,
    ) -> None:
        """Write caption and figure on the left, the word on the right."""
        scale = self.scale
        line = QRectF(place.left(), 5.0 * scale, place.width(), 20.0 * scale)
        left = int(Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter)
        right = int(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
        painter.setFont(font_of(9, scale))
        painter.setPen(QUIET)
        painter.drawText(line, left, caption)
        width = painter.fontMetrics().horizontalAdvance(caption + "  ")
        painter.setFont(font_of(10, scale, bold=True))
        painter.setPen(colour if word else INK)
        taken = painter.fontMetrics().horizontalAdvance(word + "  ")
        painter.drawText(line, right, word)
        painter.setPen(INK)
        room = line.adjusted(width, 0.0, -taken if word else 0.0, 0.0)
        cut = Qt.TextElideMode.ElideRight
        short = painter.fontMetrics().elidedText(figure, cut, int(room.width()))
        painter.drawText(room, left, short)
