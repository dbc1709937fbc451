"""A session's time line: where one is, and what happened when, a lane for each kind."""

from collections.abc import Sequence

from PySide6.QtCore import QEvent, QPointF, QRectF, QSize, Qt, Signal
from PySide6.QtGui import (
    QColor,
    QHelpEvent,
    QKeyEvent,
    QMouseEvent,
    QPainter,
    QPaintEvent,
    QPen,
    QPolygonF,
)
from PySide6.QtWidgets import QSizePolicy, QToolTip, QWidget

from app.window.scaling import Scaled
from app.window.style import (
    ALARM,
    CAUTION,
    EDGE,
    INK,
    PANEL,
    QUIET,
    READY,
    WARNING,
    font_of,
)
from app.window.texts import tr
from paravol.sessions.keyframes import APART_S
from paravol.sessions.time_marks import MarkKind, TimeMark

LANE_PX = 14.0
NAME_PX = 84.0
AXIS_PX = 18.0
EDGE_PX = 22.0

CATCH_PX = 6.0
"""So near a mark the mouse means it."""

_NICE_S = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 15.0, 30.0, 60.0, 120.0, 300.0, 600.0)
TICKS = 12
"""At most."""

_COLOURS = {
    MarkKind.TASK: READY,
    MarkKind.INJURY: ALARM,
    MarkKind.NEAR: CAUTION,
    MarkKind.TOOL: QUIET,
    MarkKind.MOMENT: INK,
    MarkKind.NOTE: WARNING,
}


class TimeLine(QWidget, Scaled):
    """Show a session's time line; press, drag or use keys to go elsewhere in it."""

    sought = Signal(float)
    """Somebody wants to go to this second of the session."""

    def __init__(self) -> None:
        super().__init__()
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self.setMouseTracking(True)
        self.setAccessibleName(tr("Time line"))
        self._span = 0.0, 1.0
        self._at_s = 0.0
        self._near_s = 0.0
        self._marks: list[TimeMark] = []
        self.take_scale()

    def take_scale(self) -> None:
        """Be as high as the lanes."""
        self.setFixedHeight(self.sizeHint().height())

    def sizeHint(self) -> QSize:
        """Return the height that is needed; any width will do."""
        high = LANE_PX * len(MarkKind) + AXIS_PX + 6.0
        return QSize(320, round(high * self.scale))

    def show_session(self, begin_s: float, end_s: float) -> None:
        """Take another session, without marks."""
        self._span = begin_s, max(end_s, begin_s + 1e-3)
        self._marks = []
        self._near_s = end_s
        self.show_time(begin_s)

    def show_near(self, until_s: float) -> None:
        """Say up to when every moment is shown at once; what is later takes longer."""
        self._near_s = until_s
        self.update()

    def show_marks(self, marks: Sequence[TimeMark]) -> None:
        """Show these marks in place of those before."""
        self._marks = list(marks)
        self.update()

    def show_time(self, time_s: float) -> None:
        """Stand at a time."""
        if time_s != self._at_s:
            self._at_s = time_s
            self.setAccessibleDescription(tr("{time_s:.1f} seconds", time_s=time_s))
            self.update()

    def x_of(self, time_s: float) -> float:
        """Return where a time is, in pixels from the left."""
        begin_s, end_s = self._span
        left, width = self._room()
        return left + width * (time_s - begin_s) / (end_s - begin_s)

    def time_at(self, x: float) -> float:
        """Return which time is at a place, held within the session."""
        begin_s, end_s = self._span
        left, width = self._room()
        share = min(max((x - left) / width, 0.0), 1.0)
        return begin_s + share * (end_s - begin_s)

    def _room(self) -> tuple[float, float]:
        left = NAME_PX * self.scale
        return left, max(self.width() - left - EDGE_PX * self.scale, 1.0)

    def mark_at(self, place: QPointF) -> TimeMark | None:
        """Return the mark at a place of the widget, None beside all of them."""
        kinds = list(MarkKind)
        row = int(place.y() // (LANE_PX * self.scale))
        if not 0 <= row < len(kinds):
            return None
        near = CATCH_PX * self.scale
        found = [
            (self._beside(mark, place.x()), number)
            for number, mark in enumerate(self._marks)
            if mark.kind is kinds[row]
        ]
        away, number = min(found, default=(near + 1.0, 0))
        return self._marks[number] if away <= near else None

    def _beside(self, mark: TimeMark, x: float) -> float:
        """Return how many pixels a place is beside a mark; 0 upon it."""
        left, right = self.x_of(mark.begin_s), self.x_of(mark.end_s)
        return max(left - x, x - right, 0.0)

    def event(self, event: QEvent) -> bool:
        """Say what a mark means where the mouse rests."""
        if isinstance(event, QHelpEvent) and event.type() == QEvent.Type.ToolTip:
            mark = self.mark_at(QPointF(event.pos()))
            words = f"{self.time_at(event.pos().x()):.2f} s"
            if mark is not None:
                words = f"{mark.time_s:.1f} s · {tr(mark.text)}"
            QToolTip.showText(event.globalPos(), words, self)
            return True
        return super().event(event)

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Go to the mark, or the time, that is pressed."""
        if event.button() == Qt.MouseButton.LeftButton:
            mark = self.mark_at(event.position())
            x = event.position().x()
            self.sought.emit(self.time_at(x) if mark is None else mark.time_s)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Scrub while the button is down."""
        if event.buttons() & Qt.MouseButton.LeftButton:
            self.sought.emit(self.time_at(event.position().x()))

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Leave all keys to the page."""
        event.ignore()

    def paintEvent(self, event: QPaintEvent) -> None:
        """Paint lanes, marks, the axis, and where one is."""
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.fillRect(self.rect(), QColor(PANEL))
        scale = self.scale
        left, width = self._room()
        high = LANE_PX * scale
        painter.setFont(font_of(8, scale))
        for row, kind in enumerate(MarkKind):
            top = row * high
            painter.setPen(QColor(QUIET))
            names = QRectF(0.0, top, left - 8.0 * scale, high)
            right = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter
            painter.drawText(names, int(right), tr(kind))
            painter.setPen(QPen(QColor(EDGE), 1.0))
            middle = top + high / 2.0
            painter.drawLine(QPointF(left, middle), QPointF(left + width, middle))
            for mark in self._marks:
                if mark.kind is kind:
                    self._paint_mark(painter, mark, middle)
        self._paint_axis(painter, len(MarkKind) * high)
        self._paint_far(painter)
        x = self.x_of(self._at_s)
        painter.setPen(QPen(QColor(INK), 2.0 * scale))
        painter.drawLine(QPointF(x, 0.0), QPointF(x, float(self.height())))
        if self.hasFocus():
            painter.setPen(QPen(QColor(READY), 2.0 * scale))
            painter.drawRect(QRectF(self.rect()).adjusted(1.0, 1.0, -1.0, -1.0))
        painter.end()

    def _paint_mark(self, painter: QPainter, mark: TimeMark, middle: float) -> None:
        """Paint a span as a bar and its moment by its kind's shape."""
        half = 4.5 * self.scale
        colour = QColor(_COLOURS[mark.kind])
        painter.setPen(Qt.PenStyle.NoPen)
        left, right = self.x_of(mark.begin_s), self.x_of(mark.end_s)
        if right - left > 1.0:
            faint = QColor(colour)
            faint.setAlphaF(0.45)
            painter.setBrush(faint)
            painter.drawRect(QRectF(left, middle - half / 2.0, right - left, half))
        at = QPointF(self.x_of(mark.time_s), middle)
        painter.setBrush(colour)
        corners = [at + corner * half for corner in _SHAPES[mark.kind]]
        painter.drawPolygon(QPolygonF(corners))

    def _paint_far(self, painter: QPainter) -> None:
        """Shade what is later than all that is near, but for the last bit of it."""
        end_s = self._span[1]
        if self._near_s > end_s - APART_S:
            return
        far = QColor(EDGE)
        far.setAlphaF(0.6)
        left, right = self.x_of(self._near_s), self.x_of(end_s)
        painter.fillRect(QRectF(left, 0.0, right - left, float(self.height())), far)

    def _paint_axis(self, painter: QPainter, top: float) -> None:
        begin_s, end_s = self._span
        lasts_s = end_s - begin_s
        fitting = [s for s in _NICE_S if lasts_s / s <= TICKS]
        step_s = fitting[0] if fitting else lasts_s / TICKS
        painter.setPen(QColor(QUIET))
        number = int(-(-begin_s // step_s))
        while number * step_s <= end_s + 1e-9:
            time_s = number * step_s
            x = self.x_of(time_s)
            painter.drawLine(QPointF(x, top), QPointF(x, top + 3.0 * self.scale))
            scale = self.scale
            box = QRectF(
                x - 40.0 * scale, top + 3.0 * scale, 80.0 * scale, 16.0 * scale
            )
            centre = Qt.AlignmentFlag.AlignHCenter | Qt.AlignmentFlag.AlignTop
            painter.drawText(box, int(centre), clock_text(time_s, step_s))
            number += 1


def clock_text(time_s: float, step_s: float = 0.1) -> str:
    """Return a time as minutes and seconds; tenths where steps are that short."""
    minutes, seconds = divmod(round(time_s, 1), 60.0)
    return (
        f"{minutes:.0f}:{seconds:04.1f}"
        if step_s < 1.0
        else (f"{minutes:.0f}:{seconds:02.0f}")
    )


_DIAMOND = ((1, 0), (0, 1), (-1, 0), (0, -1))
_SQUARE = ((0.8, 0.8), (-0.8, 0.8), (-0.8, -0.8), (0.8, -0.8))
_UP = ((0, -1), (1, 0.9), (-1, 0.9))
_DOWN = ((0, 1), (1, -0.9), (-1, -0.9))
_BAR = ((0.3, 1), (-0.3, 1), (-0.3, -1), (0.3, -1))
_FLAG = ((-0.9, 1), (-0.9, -1.1), (1.1, -0.4), (-0.4, 0.3), (-0.4, 1))
_SHAPES = {
    kind: [QPointF(*corner) for corner in corners]
    for kind, corners in (
        (MarkKind.TASK, _SQUARE),
        (MarkKind.INJURY, _UP),
        (MarkKind.NEAR, _DOWN),
        (MarkKind.TOOL, _BAR),
        (MarkKind.MOMENT, _DIAMOND),
        (MarkKind.NOTE, _FLAG),
    )
}
"""A shape for each kind: colour alone tells nothing."""
