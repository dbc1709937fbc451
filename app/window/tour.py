"""A short tour: cards over a page that point at its parts, one after the other."""

from collections.abc import Sequence
from dataclasses import dataclass

from PySide6.QtCore import QEvent, QObject, QPoint, QRect, QRectF, Qt, Signal
from PySide6.QtGui import QColor, QKeyEvent, QPainter, QPainterPath, QPaintEvent, QPen
from PySide6.QtWidgets import (
    QFrame,
    QHBoxLayout,
    QPushButton,
    QVBoxLayout,
    QWidget,
)

from app.window.page_style import page_sheet
from app.window.plain_label import PlainLabel, paragraph
from app.window.style import READY
from app.window.texts import tr

_DIMMED = QColor(0, 0, 0, 165)
_CARD_WIDTH = 380.0
_GAP = 14.0


@dataclass(frozen=True, slots=True)
class TourStop:
    """One card: the part of the page that it is about, None for all of it."""

    part: QWidget | None
    title: str
    text: str


class Tour(QWidget):
    """Cover a page until its tour is over."""

    ended = Signal()
    """It was seen or skipped."""

    def __init__(self, page: QWidget, stops: Sequence[TourStop], scale: float) -> None:
        """Show the first of one or more stops over a page; scale: of its texts."""
        super().__init__(page)
        self._page = page
        # what an exercise does not have is hidden, and not told of
        self._stops = [s for s in stops if s.part is None or s.part.isVisible()]
        self._number = 0
        self._scale = scale
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setStyleSheet(page_sheet(scale))
        self._card = QFrame(self)
        self._card.setObjectName("card")
        self._card.setProperty("marked", True)
        self._count = PlainLabel()
        self._title, self._text = paragraph("", "heading"), paragraph("", "body")
        self._next = QPushButton()
        self._next.setObjectName("primary")
        self._next.clicked.connect(self._go_on)
        skip = QPushButton(tr("Skip (Esc)"))
        skip.clicked.connect(self.end)
        for button in (self._next, skip):
            button.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        buttons = QHBoxLayout()
        buttons.addWidget(self._count, 1)
        buttons.addWidget(skip)
        buttons.addWidget(self._next)
        rows = self._rows = QVBoxLayout(self._card)
        margin = round(14 * scale)
        rows.setContentsMargins(margin, margin, margin, margin)
        rows.setSpacing(round(8 * scale))
        rows.addWidget(self._title)
        rows.addWidget(self._text)
        rows.addLayout(buttons)
        page.installEventFilter(self)
        self.setGeometry(page.rect())
        self._show_stop()
        self.show()
        self.raise_()
        self.setFocus()

    @property
    def stop(self) -> TourStop:
        """Return what is told of now."""
        return self._stops[self._number]

    def end(self) -> None:
        """Take the tour away."""
        self._page.removeEventFilter(self)
        self.hide()
        self.ended.emit()
        self.deleteLater()

    def _go_on(self) -> None:
        if self._number + 1 == len(self._stops):
            self.end()
        else:
            self._number += 1
            self._show_stop()

    def _go_back(self) -> None:
        self._number = max(self._number - 1, 0)
        self._show_stop()

    def _show_stop(self) -> None:
        stop, is_last = self.stop, self._number + 1 == len(self._stops)
        self._title.setText(stop.title)
        self._text.setText(stop.text)
        self._count.setText(
            tr("{number} of {count}", number=self._number + 1, count=len(self._stops))
        )
        self._next.setText(tr("Begin (Enter)") if is_last else tr("Next (Enter)"))
        self.setAccessibleName(f"{stop.title}. {stop.text}")
        self._place()
        self.update()

    def _hole(self) -> QRect:
        """Return where the part lies, empty for the whole page."""
        part = self.stop.part
        if part is None:
            return QRect()
        corner = part.mapTo(self._page, QPoint(0, 0))
        gap = round(4 * self._scale)
        found = QRect(corner, part.size()).adjusted(-gap, -gap, gap, gap)
        return found.intersected(self.rect())

    def _place(self) -> None:
        """Put the card beside the part, where there is most room."""
        gap = round(_GAP * self._scale)
        self._card.ensurePolished()  # its edge counts
        self._rows.activate()  # so do the texts of the buttons
        least = self._rows.totalMinimumSize().width()
        width = max(round(_CARD_WIDTH * self._scale), least)
        width = min(width, self.width() - 2 * gap)
        self._card.setFixedWidth(width)
        # a height that the text's width asks for
        high = self._rows.totalHeightForWidth(width)
        self._card.resize(width, high)
        hole, room = self._hole(), self.rect()
        corner = room.center() - QPoint(width // 2, high // 2)
        if not hole.isEmpty():
            corner = QPoint(hole.center().x() - width // 2, hole.bottom() + gap)
            if corner.y() + high > room.bottom():
                corner.setY(hole.top() - gap - high)
            if corner.y() < room.top():
                corner = QPoint(hole.left() - gap - width, hole.center().y())
                if corner.x() < room.left():
                    corner.setX(hole.right() + gap)
        box = QRect(corner, self._card.size())
        box.moveRight(min(box.right(), room.right() - gap))
        box.moveLeft(max(box.left(), room.left() + gap))
        box.moveBottom(min(box.bottom(), room.bottom() - gap))
        box.moveTop(max(box.top(), room.top() + gap))
        self._card.setGeometry(box)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Stay as large as the page."""
        if event.type() == QEvent.Type.Resize:
            self.setGeometry(self._page.rect())
            self._place()
        return False

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Go on, back, or leave; other keys do nothing meanwhile."""
        match event.key():
            case (
                Qt.Key.Key_Return
                | Qt.Key.Key_Enter
                | Qt.Key.Key_Space
                | Qt.Key.Key_Right
            ):
                self._go_on()
            case Qt.Key.Key_Left | Qt.Key.Key_Backspace:
                self._go_back()
            case Qt.Key.Key_Escape:
                self.end()

    def paintEvent(self, event: QPaintEvent) -> None:
        """Dim all but the part that is told of, and frame that."""
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        dimmed = QPainterPath()
        dimmed.addRect(QRectF(self.rect()))
        hole = QRectF(self._hole())
        radius = 6.0 * self._scale
        if not hole.isEmpty():
            dimmed.addRoundedRect(hole, radius, radius)
        painter.fillPath(dimmed, _DIMMED)
        if not hole.isEmpty():
            painter.setPen(QPen(QColor(READY), 2.0 * self._scale))
            painter.drawRoundedRect(hole, radius, radius)
        painter.end()
