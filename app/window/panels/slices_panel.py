"""Three linked slices of the head's scans: they follow the scope, or look a place up.

A click looks a place up in all three, the wheel goes through the slices under it, a
drag with the right button changes black and white; a double click follows the scope
again.
"""

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QPointF, QRectF, QSize, Qt, Signal
from PySide6.QtGui import (
    QColor,
    QImage,
    QMouseEvent,
    QPainter,
    QPaintEvent,
    QPen,
    QPolygonF,
    QResizeEvent,
    QWheelEvent,
)
from PySide6.QtWidgets import QSizePolicy, QWidget

from app.window.panels.qt_image import image_of
from app.window.scaling import Scaled
from app.window.style import OVER, font_of
from app.window.texts import later, tr
from paravol.slices.side_letters import place_text
from paravol.slices.slice_views import GRAY_WINDOWS, Plane, Show, SliceViews

HEIGHT_PX = 150
GAP_PX = 6
SHOWN_MM = 70.0
"""Edge of the square around the tip that each slice shows."""

LARGE_SHOWN_MM = 110.0
"""The same where the slices fill the page's large place."""

MARK = "#f0e442"
"""Of the scope's tip; of Okabe and Ito's palette, as the others are."""

TOOL_MARK = "#e69f00"
PLACE_MARK = "#56b4e9"

ON_SLICE_MM = 1.0
"""What lies farther from a slice is marked faintly."""

HU_PER_PIXEL = 4.0
"""How much a drag over one pixel changes the window."""

FOLLOWS = later("The slices follow the scope")
WIDGET_MOST = 16777215
"""Qt's own limit to what a widget measures."""

LEGEND = (
    (MARK, later("+ the scope's tip")),
    (TOOL_MARK, later("◇ the tool's tip")),
    (PLACE_MARK, later("□ the task's place")),
    (PLACE_MARK, later("○ the place that is looked up")),
)
_NOTCH = 120.0
_TITLES = {Show.CT: "CT", Show.MR: "MR", Show.BOTH: later("CT bone on MR")}
_Place = NDArray[np.float64]


class SlicesView(QWidget, Scaled):
    """Show where the tip is in the head's own scans, or what lies at a place."""

    told = Signal(str)
    """What is shown, in a line, whenever that changes."""

    def __init__(self) -> None:
        super().__init__()
        self._is_large = False
        self.show_kind = Show.CT
        self.plane = Plane.AXIAL
        """The plane that keys scroll through."""
        self.window_hu = GRAY_WINDOWS[0]
        self._views: SliceViews | None = None
        self._at_mm: _Place | None = None
        self._center_mm: _Place | None = None
        self._tip_mm: _Place | None = None
        self._tool_mm: _Place | None = None
        self._goal_mm: _Place | None = None
        self._is_following = True
        self._images: dict[Plane, QImage] = {}
        self._is_stale = False
        self._windowed_from: QPointF | None = None
        self._info = ""
        self.set_large(False)

    def take_scale(self) -> None:
        """Be as high as is needed."""
        self._fit()

    def set_large(self, is_large: bool) -> None:
        """Take all the room there is, or the little that a side column has."""
        self._is_large = is_large
        policy = QSizePolicy.Policy
        self.setSizePolicy(
            policy.Expanding, policy.Expanding if is_large else policy.Fixed
        )
        self._fit()
        self.update()

    def _fit(self) -> None:
        """Be as high as three slices side by side need, where the column is narrow."""
        high = round(HEIGHT_PX * self.scale)
        if self._is_large:
            self.setMinimumHeight(high // 2)
            self.setMaximumHeight(WIDGET_MOST)
        else:
            gap = round(GAP_PX * self.scale)
            self.setFixedHeight(min(high, max((self.width() - 2 * gap) // 3, 1)))

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Leave no room above and below the slices."""
        if event.size().width() != event.oldSize().width():
            self._fit()

    def sizeHint(self) -> QSize:
        """Return the height that is needed; any width will do."""
        return QSize(240, round(HEIGHT_PX * self.scale))

    @property
    def info(self) -> str:
        """Return what is shown: scan, window, plane, place."""
        if self._views is None or self._at_mm is None:
            return ""
        words = [tr(_TITLES[self.show_kind])]
        if self.show_kind is Show.CT:
            words[0] += f" {tr(self.window_hu.text())}"
        if self._is_following:
            words.append(tr("follows the scope"))
        else:
            number = float(self._views.ct.sample(self._at_mm))
            words += [
                f"{self.plane.name.lower()}: {place_text(self._at_mm)}",
                f"{number:.0f} HU",
            ]
        return " · ".join(words)

    @property
    def place_mm(self) -> _Place | None:
        """Return the place that is looked up, ``(3,)`` LPS; None while following."""
        return None if self._is_following else self._at_mm

    def show_head(self, views: SliceViews) -> None:
        """Take the head's volumes."""
        self._views = views
        self._at_mm = self._center_mm = views.ct.center_mm
        self._draw()

    def refresh(self) -> None:
        """Draw the slices again when they follow next: tissue was cut or put back."""
        self._is_stale = True

    def follow(
        self,
        tip_mm: _Place,
        tool_mm: _Place | None = None,
        goal_mm: _Place | None = None,
    ) -> None:
        """Mark the scope's tip, ``(3,)`` LPS, and the tool's; cut there if following.

        tool_mm: None where no tool is in hand. goal_mm: of the task; None for none.
        """
        if _moved(self._goal_mm, goal_mm):
            self._goal_mm = goal_mm
            self.update()
        known, tool = self._tip_mm, self._tool_mm
        self._tip_mm = np.array(tip_mm)
        self._tool_mm = None if tool_mm is None else np.array(tool_mm)
        if self._views is None:
            return
        if self._is_following:
            moved = self._at_mm is None or np.abs(tip_mm - self._at_mm).max() > 0.1
            if moved or self._is_stale:
                self._at_mm = self._center_mm = self._tip_mm
                self._draw()
            elif _moved(tool, self._tool_mm):
                self.update()
        elif self._is_stale:
            self._draw()
        elif _moved(known, self._tip_mm) or _moved(tool, self._tool_mm):
            self.update()

    def switch(self) -> str:
        """Go on to the next scan; gives its name, or why there is only one."""
        if self._views is None or self._views.second is None:
            return tr("This head has one scan only")
        self.show_kind = self.show_kind.next()
        self._draw()
        return tr(_TITLES[self.show_kind])

    def look_up(self, place_mm: _Place) -> None:
        """Cut all three slices through a place, until `follow_again`."""
        if self._views is None:
            return
        self._is_following = False
        self._at_mm = self._views.within(np.array(place_mm, np.float64))
        # what was looked at stays where it was, unless the place would be out of sight
        assert self._center_mm is not None
        reach = 0.45 * self._shown_mm
        self._center_mm = np.clip(
            self._center_mm, self._at_mm - reach, self._at_mm + reach
        )
        self._draw()

    def follow_again(self) -> None:
        """Follow the scope."""
        self._is_following = True
        if self._tip_mm is not None:
            self._at_mm = self._center_mm = self._tip_mm
        if self._views is not None:
            self._draw()

    def switch_following(self) -> str:
        """Look the scope's place up, or follow the scope again; say which."""
        if self._views is None or self._at_mm is None:
            return tr("There are no slices yet")
        if self._is_following:
            self.look_up(self._at_mm)
            return tr("The slices stay at this place")
        self.follow_again()
        return tr(FOLLOWS)

    def step(self, slices: float) -> None:
        """Scroll so many slices through the chosen plane."""
        if self._views is not None and self._at_mm is not None:
            self.look_up(self._views.stepped(self.plane, self._at_mm, slices))

    def nudge(self, right: float, down: float) -> None:
        """Move the place in the chosen plane, by voxels of its picture."""
        if self._views is None or self._at_mm is None:
            return
        column, row = self._views.place(self.plane, self._at_mm)
        place = self._views.found(self.plane, column + right, row + down, self._at_mm)
        self.look_up(place)

    def next_plane(self) -> str:
        """Choose the next plane for keys; gives its name."""
        every = list(Plane)
        self.plane = every[(every.index(self.plane) + 1) % len(every)]
        self._tell()
        return self.plane.name.capitalize()

    def next_window(self) -> str:
        """Choose the next black and white for the CT; say which."""
        names = [window.name for window in GRAY_WINDOWS]
        known = self.window_hu.name
        place = names.index(known) + 1 if known in names else 0
        self.window_hu = GRAY_WINDOWS[place % len(names)]
        return self._windowed()

    def change_window(self, wider: float, brighter: float) -> str:
        """Make the CT's window wider and all brighter, by HU; say which it is then."""
        self.window_hu = self.window_hu.moved(wider, brighter)
        return self._windowed()

    def _windowed(self) -> str:
        if self._views is not None:
            self._draw()
        low, high = self.window_hu.ends
        return tr(
            "CT window {window}: {low:.0f} to {high:.0f} HU",
            window=tr(self.window_hu.text()),
            low=low,
            high=high,
        )

    def _draw(self) -> None:
        assert self._views is not None
        assert self._at_mm is not None
        self._is_stale = False
        for plane in Plane:
            pixels = self._views.picture(
                plane, self._at_mm, self.show_kind, self.window_hu.ends
            )
            self._images[plane] = image_of(pixels)
        self._tell()

    def _tell(self) -> None:
        if self.info != self._info:
            self._info = self.info
            self.setAccessibleName(tr("Slices: {info}", info=self._info))
            self.told.emit(self._info)
        self.update()

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Look a place up, or begin to change the window."""
        if event.button() == Qt.MouseButton.RightButton:
            self._windowed_from = event.position()
        elif event.button() == Qt.MouseButton.LeftButton:
            self._look_up_at(event.position())

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Look further places up, or change the window."""
        if event.buttons() & Qt.MouseButton.LeftButton:
            self._look_up_at(event.position())
        elif self._windowed_from is not None:
            moved = (event.position() - self._windowed_from) / self.scale
            self._windowed_from = event.position()
            self.change_window(HU_PER_PIXEL * moved.x(), -HU_PER_PIXEL * moved.y())

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """Let go of the window."""
        self._windowed_from = None

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        """Follow the scope again."""
        if event.button() == Qt.MouseButton.LeftButton:
            self.follow_again()

    def wheelEvent(self, event: QWheelEvent) -> None:
        """Scroll through the slices of the plane below the mouse."""
        plane = self._plane_at(event.position())
        if plane is not None:
            self.plane = plane
            self.step(event.angleDelta().y() / _NOTCH)

    def _look_up_at(self, position: QPointF) -> None:
        plane = self._plane_at(position)
        if plane is None or self._views is None or self._at_mm is None:
            return
        self.plane = plane
        square, source = self._squares()[plane], self._source(plane)
        across = (position - square.topLeft()) / square.width()
        column = source.left() + across.x() * source.width() - 0.5
        row = source.top() + across.y() * source.height() - 0.5
        self.look_up(self._views.found(plane, column, row, self._at_mm))

    def _plane_at(self, position: QPointF) -> Plane | None:
        for plane, square in self._squares().items():
            if square.contains(position):
                return plane
        return None

    @property
    def _shown_mm(self) -> float:
        return LARGE_SHOWN_MM if self._is_large else SHOWN_MM

    def _squares(self) -> dict[Plane, QRectF]:
        """Place the slices side by side, below each other or two and one."""
        gap, width, height = GAP_PX * self.scale, self.width(), self.height()
        grids = ((3, 1), (1, 3), (2, 2))
        edges = [
            min((width - (c - 1) * gap) / c, (height - (r - 1) * gap) / r)
            for c, r in grids
        ]
        columns, rows = grids[int(np.argmax(edges))]
        edge = max(edges)
        left = (width - columns * edge - (columns - 1) * gap) / 2
        top = (height - rows * edge - (rows - 1) * gap) / 2
        places = {}
        for number, plane in enumerate(Plane):
            row, column = divmod(number, columns)
            corner = QPointF(left + column * (edge + gap), top + row * (edge + gap))
            places[plane] = QRectF(corner.x(), corner.y(), edge, edge)
        return places

    def _source(self, plane: Plane) -> QRectF:
        """Return the part of a plane's picture that is shown, in its pixels."""
        assert self._views is not None
        assert self._center_mm is not None
        column, row = self._views.place(plane, self._center_mm)
        shown = self._shown_mm / float(self._views.ct.spacing_mm[0])
        return QRectF(column + 0.5 - shown / 2, row + 0.5 - shown / 2, shown, shown)

    def paintEvent(self, event: QPaintEvent) -> None:
        """Paint the three slices."""
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform)
        for plane, square in self._squares().items():
            painter.fillRect(square, Qt.GlobalColor.black)
            if self._views is not None and self._at_mm is not None:
                self._paint(painter, square, plane)
        self._paint_legend(painter)
        painter.end()

    def _paint_legend(self, painter: QPainter) -> None:
        """Say beside two rows of slices what is marked."""
        squares = self._squares()
        beside = squares[Plane.CORONAL].left(), squares[Plane.SAGITTAL].top()
        corner = QPointF(*beside)
        if any(square.contains(corner + QPointF(1, 1)) for square in squares.values()):
            return
        edge = squares[Plane.AXIAL].width()
        inset = 14.0 * self.scale
        line = QRectF(corner.x(), corner.y(), edge, edge)
        painter.fillRect(line, Qt.GlobalColor.black)
        line.adjust(inset, inset, -inset, -inset)
        painter.setFont(font_of(10, self.scale))
        wrap = int(Qt.AlignmentFlag.AlignTop | Qt.TextFlag.TextWordWrap)
        for colour, text in (*LEGEND, (OVER.quiet.name(), self._info)):
            painter.setPen(QColor(colour))
            said = tr(text)
            drawn = painter.boundingRect(line, wrap, said)
            painter.drawText(line, wrap, said)
            line.setTop(drawn.bottom() + 6.0 * self.scale)

    def _paint(self, painter: QPainter, square: QRectF, plane: Plane) -> None:
        # Qt leaves out what lies beyond the picture and keeps the scale
        painter.drawImage(square, self._images[plane], self._source(plane))
        painter.setClipRect(square)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        if not self._is_following:
            self._mark_place(painter, square, plane)
        elif self._tip_mm is not None:
            self._cross(painter, square, plane, self._tip_mm, MARK)
        if self._goal_mm is not None:
            self._mark_goal(painter, square, plane, self._goal_mm)
        if self._tool_mm is not None:
            self._mark_tool(painter, square, plane)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing, False)
        if self._tip_mm is not None:
            self._mark_tip(painter, square, plane, self._tip_mm)
        self._letter(painter, square, plane)
        painter.setClipping(False)

    def _point(self, square: QRectF, plane: Plane, place_mm: _Place) -> QPointF:
        """Return where a place is in a plane's square."""
        assert self._views is not None
        column, row = self._views.place(plane, place_mm)
        source = self._source(plane)
        per_pixel = square.width() / source.width()
        return square.topLeft() + QPointF(
            per_pixel * (column + 0.5 - source.left()),
            per_pixel * (row + 0.5 - source.top()),
        )

    def _colour(self, name: str, plane: Plane, place_mm: _Place) -> QColor:
        """Return a mark's colour, faint where the mark is off the slice."""
        assert self._at_mm is not None
        axis = 2 - plane.value
        colour = QColor(name)
        if abs(float(place_mm[axis] - self._at_mm[axis])) > ON_SLICE_MM:
            colour.setAlpha(120)
        return colour

    def _mark_tip(
        self, painter: QPainter, square: QRectF, plane: Plane, tip_mm: _Place
    ) -> None:
        """Mark the scope's tip by a cross that is open in the middle."""
        middle, scale = self._point(square, plane, tip_mm), self.scale
        painter.setPen(QPen(self._colour(MARK, plane, tip_mm), 1.5 * scale))
        for dx, dy in ((1, 0), (-1, 0), (0, 1), (0, -1)):
            way = QPointF(dx, dy) * scale
            painter.drawLine(middle + way * 3.0, middle + way * 9.0)

    def _mark_tool(self, painter: QPainter, square: QRectF, plane: Plane) -> None:
        """Mark the tool's tip by a diamond."""
        assert self._tool_mm is not None
        middle = self._point(square, plane, self._tool_mm)
        half = 5.0 * self.scale
        corners = ((half, 0.0), (0.0, half), (-half, 0.0), (0.0, -half))
        painter.setBrush(Qt.BrushStyle.NoBrush)
        colour = self._colour(TOOL_MARK, plane, self._tool_mm)
        painter.setPen(QPen(colour, 1.5 * self.scale))
        painter.drawPolygon(QPolygonF([middle + QPointF(*c) for c in corners]))

    def _mark_place(self, painter: QPainter, square: QRectF, plane: Plane) -> None:
        """Mark the place by a ring, and where the other two slices are cut."""
        assert self._at_mm is not None
        self._cross(painter, square, plane, self._at_mm, PLACE_MARK)
        middle, scale = self._point(square, plane, self._at_mm), self.scale
        gap = 6.0 * scale
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.setPen(QPen(QColor(PLACE_MARK), 1.5 * scale))
        painter.drawEllipse(middle, gap, gap)

    def _mark_goal(
        self, painter: QPainter, square: QRectF, plane: Plane, goal_mm: _Place
    ) -> None:
        """Mark the task's place by a square; at the edge where it lies beyond."""
        middle, half = self._point(square, plane, goal_mm), 5.0 * self.scale
        room = square.adjusted(half, half, -half, -half)
        middle.setX(min(max(middle.x(), room.left()), room.right()))
        middle.setY(min(max(middle.y(), room.top()), room.bottom()))
        painter.setBrush(Qt.BrushStyle.NoBrush)
        colour = self._colour(PLACE_MARK, plane, goal_mm)
        painter.setPen(QPen(colour, 1.5 * self.scale))
        painter.drawRect(
            QRectF(middle.x() - half, middle.y() - half, 2 * half, 2 * half)
        )

    def _cross(
        self, painter: QPainter, square: QRectF, plane: Plane, at_mm: _Place, ink: str
    ) -> None:
        """Draw where the other two slices are cut, faintly; open in the middle."""
        middle, scale = self._point(square, plane, at_mm), self.scale
        faint = QColor(ink)
        faint.setAlpha(130 if ink == PLACE_MARK else 70)
        painter.setPen(QPen(faint, scale))
        x, y, gap = middle.x(), middle.y(), (6.0 if ink == PLACE_MARK else 10.0) * scale
        painter.drawLine(QPointF(square.left(), y), QPointF(x - gap, y))
        painter.drawLine(QPointF(x + gap, y), QPointF(square.right(), y))
        painter.drawLine(QPointF(x, square.top()), QPointF(x, y - gap))
        painter.drawLine(QPointF(x, y + gap), QPointF(x, square.bottom()))

    def _letter(self, painter: QPainter, square: QRectF, plane: Plane) -> None:
        """Write what lies on each side; name the plane that keys go through."""
        painter.setFont(font_of(9, self.scale, bold=True))
        flag = Qt.AlignmentFlag
        inner = square.adjusted(3, 1, -3, -1)
        across, down = flag.AlignVCenter, flag.AlignHCenter
        left, right, top, bottom = plane.letters
        texts = [
            (flag.AlignLeft | across, left),
            (flag.AlignRight | across, right),
            (flag.AlignTop | down, top),
            (flag.AlignBottom | down, bottom),
        ]
        if plane is Plane.AXIAL:
            both = self.show_kind is Show.BOTH
            short = tr("both") if both else _TITLES[self.show_kind]
            texts.append((flag.AlignBottom | flag.AlignLeft, short))
        if plane is self.plane and not self._is_following:
            texts.append((flag.AlignTop | flag.AlignLeft, "▸"))
        for place, text in texts:
            # dark below: bone is as bright as any letter
            painter.setPen(QColor(0, 0, 0))
            painter.drawText(inner.translated(1.0, 1.0), int(place), text)
            painter.setPen(QColor(OVER.ink))
            painter.drawText(inner, int(place), text)


def _moved(before: _Place | None, now: _Place | None) -> bool:
    if before is None or now is None:
        return before is not now
    return bool(np.abs(now - before).max() > 0.1)
