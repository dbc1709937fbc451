"""Edit a look over the histogram of its scan: points of density, opacity and colour."""

from collections.abc import Sequence

import msgspec
from PySide6.QtCore import QPointF, QRectF, QSize, Qt, Signal
from PySide6.QtGui import (
    QColor,
    QKeyEvent,
    QLinearGradient,
    QMouseEvent,
    QPainter,
    QPaintEvent,
    QPen,
    QPolygonF,
)
from PySide6.QtWidgets import QColorDialog, QWidget

from app.window.keyboard.places import american
from app.window.scaling import Scaled
from app.window.style import BACKGROUND, EDGE, INK, QUIET, READY, font_of
from app.window.texts import tr
from paravol.volume.look import LookPoint, VolumeLook
from paravol.volume.scan import Scan

_RADIUS, _REACH = 6.0, 12.0
_MARGIN, _STRIP = 14.0, 12.0

STEP = 0.02
"""Of the range, by an arrow key; Shift: a fifth of it."""

LEAST_GAP = 1e-3
"""Of the range, between two points."""


class TransferEditor(QWidget, Scaled):
    """Show histogram and points; the points are moved by mouse or keys."""

    edited = Signal(object)
    """The `VolumeLook` after an edit."""

    def __init__(self) -> None:
        super().__init__()
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setMinimumSize(QSize(240, 120))
        self.setAccessibleName(tr("Transfer function"))
        self.setToolTip(
            tr(
                "Drag a point; double click adds one; C or a right click: its colour; "
                "Delete takes it out; Tab is the next, arrows move it"
            )
        )
        self._scan: Scan | None = None
        self._bars: Sequence[float] = ()
        self._look: VolumeLook | None = None
        self._at = 0
        self._is_dragged = False

    @property
    def selected(self) -> int:
        """Return the number of the point that keys move."""
        return self._at

    def show_look(self, scan: Scan, look: VolumeLook) -> None:
        """Show a look over its scan's histogram."""
        if self._scan is not scan:
            self._scan, self._bars = scan, scan.heights().tolist()
        self._look = look
        self._at = min(self._at, len(look.points) - 1)
        self.update()

    def place_of(self, point: LookPoint) -> QPointF:
        """Return where a point is drawn."""
        assert self._scan is not None
        room, scan = self._room(), self._scan
        share = (point.density - scan.low) / (scan.high - scan.low)
        share = min(max(share, 0.0), 1.0)
        return QPointF(
            room.left() + share * room.width(),
            room.bottom() - point.opacity * room.height(),
        )

    def _room(self) -> QRectF:
        margin = _MARGIN * self.scale
        strip = _STRIP * self.scale
        return QRectF(self.rect()).adjusted(margin, margin, -margin, -margin - strip)

    def _meant(self, place: QPointF) -> tuple[float, float]:
        """Return the density and the opacity of a place."""
        assert self._scan is not None
        room, scan = self._room(), self._scan
        across = min(max((place.x() - room.left()) / room.width(), 0.0), 1.0)
        up = min(max((room.bottom() - place.y()) / room.height(), 0.0), 1.0)
        return scan.low + across * (scan.high - scan.low), up

    def _nearest(self, place: QPointF) -> int | None:
        """Return the point under the mouse, None where there is none."""
        assert self._look is not None
        found, least = None, _REACH * self.scale
        for number, point in enumerate(self._look.points):
            away = self.place_of(point) - place
            length = (away.x() ** 2 + away.y() ** 2) ** 0.5
            if length <= least:
                found, least = number, length
        return found

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Take hold of a point; the right button asks for its colour."""
        if self._look is None:
            return
        found = self._nearest(event.position())
        if found is None:
            return
        self._at = found
        if event.button() == Qt.MouseButton.RightButton:
            self._ask_colour()
        else:
            self._is_dragged = True
        self.update()

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Move the held point, between its neighbours."""
        if self._is_dragged:
            self._move_to(*self._meant(event.position()))

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """Let go."""
        self._is_dragged = False

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        """Add a point there, in the colour of the one before."""
        if self._look is None or self._nearest(event.position()) is not None:
            return
        density, opacity = self._meant(event.position())
        points = self._look.points
        after = sum(point.density < density for point in points)
        colour = points[max(after - 1, 0)].colour
        fresh = LookPoint(density, colour, opacity)
        self._at = after
        self._change((*points[:after], fresh, *points[after:]))

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Choose, move, colour or remove a point."""
        if self._look is None or self._scan is None:
            super().keyPressEvent(event)
            return
        points, key = self._look.points, american(event)
        is_fine = bool(event.modifiers() & Qt.KeyboardModifier.ShiftModifier)
        step = STEP / 5 if is_fine else STEP
        wide = step * (self._scan.high - self._scan.low)
        point = points[self._at]
        moves = {
            Qt.Key.Key_Left: (-wide, 0.0),
            Qt.Key.Key_Right: (wide, 0.0),
            Qt.Key.Key_Up: (0.0, step),
            Qt.Key.Key_Down: (0.0, -step),
        }
        if key in moves:
            across, up = moves[key]
            self._move_to(point.density + across, point.opacity + up)
        elif key in (Qt.Key.Key_N, Qt.Key.Key_P):
            way = 1 if key == Qt.Key.Key_N else -1
            self._at = (self._at + way) % len(points)
            self.update()
        elif key == Qt.Key.Key_C:
            self._ask_colour()
        elif key in (Qt.Key.Key_Delete, Qt.Key.Key_Backspace) and len(points) > 2:
            self._change((*points[: self._at], *points[self._at + 1 :]))
        else:
            super().keyPressEvent(event)

    def _move_to(self, density: float, opacity: float) -> None:
        assert self._look is not None
        assert self._scan is not None
        points, at = self._look.points, self._at
        gap = LEAST_GAP * (self._scan.high - self._scan.low)
        low = points[at - 1].density + gap if at else self._scan.low
        high = points[at + 1].density - gap if at + 1 < len(points) else self._scan.high
        moved = LookPoint(
            min(max(density, low), max(high, low)),
            points[at].colour,
            min(max(opacity, 0.0), 1.0),
        )
        self._change((*points[:at], moved, *points[at + 1 :]))

    def _ask_colour(self) -> None:
        assert self._look is not None
        point = self._look.points[self._at]
        chosen = QColorDialog.getColor(
            QColor(point.colour),
            self,
            tr("Colour at {density:.0f}", density=point.density),
        )
        if chosen.isValid():
            self.recolour(chosen.name())

    def recolour(self, colour: str) -> None:
        """Give the selected point a colour, ``#rrggbb``."""
        assert self._look is not None
        points, at = self._look.points, self._at
        other = msgspec.structs.replace(points[at], colour=colour)
        self._change((*points[:at], other, *points[at + 1 :]))

    def _change(self, points: tuple[LookPoint, ...]) -> None:
        assert self._look is not None
        self._look = msgspec.structs.replace(self._look, points=points)
        self._at = min(self._at, len(points) - 1)
        self.update()
        self.edited.emit(self._look)

    def paintEvent(self, event: QPaintEvent) -> None:
        """Paint bars, lines, points and the strip of colours."""
        painter = QPainter(self)
        painter.fillRect(self.rect(), QColor(BACKGROUND))
        if self._look is None or self._scan is None:
            painter.end()
            return
        room, scale = self._room(), self.scale
        wide = room.width() / len(self._bars)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(QColor(EDGE))
        for number, tall in enumerate(self._bars):
            high = tall * room.height()
            left = room.left() + number * wide
            painter.drawRect(QRectF(left, room.bottom() - high, wide, high))
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        points = self._look.points
        places = [self.place_of(point) for point in points]
        line = [QPointF(room.left(), places[0].y()), *places]
        line.append(QPointF(room.right(), places[-1].y()))
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.setPen(QPen(QColor(INK), 1.5 * scale))
        painter.drawPolyline(QPolygonF(line))
        strip = QRectF(
            room.left(), room.bottom() + 4.0 * scale, room.width(), 8.0 * scale
        )
        blend = QLinearGradient(strip.topLeft(), strip.topRight())
        for point, place in zip(points, places, strict=True):
            share = (place.x() - room.left()) / room.width()
            blend.setColorAt(share, QColor(point.colour))
        painter.fillRect(strip, blend)
        for number, (point, place) in enumerate(zip(points, places, strict=True)):
            is_chosen = number == self._at
            edge = READY if is_chosen and self.hasFocus() else INK
            painter.setPen(QPen(QColor(edge), (2.5 if is_chosen else 1.2) * scale))
            painter.setBrush(QColor(point.colour))
            radius = _RADIUS * scale * (1.25 if is_chosen else 1.0)
            painter.drawEllipse(place, radius, radius)
        point = points[self._at]
        painter.setFont(font_of(9, scale))
        painter.setPen(QColor(QUIET))
        unit = " HU" if self._scan.is_ct else ""
        told = tr(
            "{density:.0f}{unit}: opacity {opacity:.2f} a mm",
            density=point.density,
            unit=unit,
            opacity=point.opacity,
        )
        painter.drawText(self.rect(), int(Qt.AlignmentFlag.AlignTop), f"  {told}")
        painter.end()
