"""The three slices at the scope's tip in the window, CT, MR or both."""

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QImage, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QWidget

from app.window.panels.qt_image import image_of
from app.window.style import INK, font_of
from paravol.slice_views import Plane, Show, SliceViews

HEIGHT_PX = 150
GAP_PX = 6
SHOWN_MM = 70.0
"""Edge of the square around the tip that each slice shows."""

MARK = "#ffd166"
_TITLES = {Show.CT: "CT", Show.MR: "MR", Show.BOTH: "CT bone on MR"}


class SlicesView(QWidget):
    """Show where the tip is in the head's own scans."""

    def __init__(self) -> None:
        super().__init__()
        self._scale = 1.0
        self.setFixedHeight(HEIGHT_PX)
        self.show_kind = Show.CT
        self._views: SliceViews | None = None
        self._at_mm: NDArray[np.float64] | None = None
        self._images: dict[Plane, QImage] = {}
        self._is_stale = False

    def set_scale(self, scale: float) -> None:
        """Scale the layout; 1 is the designed size."""
        self._scale = scale
        self.setFixedHeight(round(HEIGHT_PX * scale))

    def show_head(self, views: SliceViews) -> None:
        """Take the head's volumes."""
        self._views = views
        self._at_mm = views.ct.center_mm
        self._draw()

    def refresh(self) -> None:
        """Draw the slices again when they follow next: tissue was cut or put back."""
        self._is_stale = True

    def follow(self, tip_mm: NDArray[np.float64]) -> None:
        """Cut through the tip, ``(3,)`` LPS."""
        moved = self._at_mm is None or np.abs(tip_mm - self._at_mm).max() > 0.1
        if self._views is not None and (moved or self._is_stale):
            self._at_mm = np.array(tip_mm)
            self._draw()

    def switch(self) -> str:
        """Go on to the next scan; gives its name, or why there is only one."""
        if self._views is None or self._views.second is None:
            return "This head has one scan only"
        self.show_kind = self.show_kind.next()
        self._draw()
        return _TITLES[self.show_kind]

    def _draw(self) -> None:
        assert self._views is not None
        assert self._at_mm is not None
        self._is_stale = False
        for plane in Plane:
            pixels = self._views.picture(plane, self._at_mm, self.show_kind)
            self._images[plane] = image_of(pixels)
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        """Paint the three slices side by side, the tip in the middle of each."""
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform)
        gap = GAP_PX * self._scale
        edge = min((self.width() - 2 * gap) / 3, float(self.height()))
        for number, plane in enumerate(Plane):
            square = QRectF(number * (edge + gap), 0.0, edge, edge)
            painter.fillRect(square, Qt.GlobalColor.black)
            if self._views is not None and self._at_mm is not None:
                self._paint(painter, square, plane)
        painter.end()

    def _paint(self, painter: QPainter, square: QRectF, plane: Plane) -> None:
        assert self._views is not None
        assert self._at_mm is not None
        column, row = self._views.place(plane, self._at_mm)
        shown = SHOWN_MM / float(self._views.ct.spacing_mm[0])
        source = QRectF(column + 0.5 - shown / 2, row + 0.5 - shown / 2, shown, shown)
        # Qt leaves out what lies beyond the picture and keeps the scale
        painter.drawImage(square, self._images[plane], source)
        middle = square.center()
        scale = self._scale
        painter.setPen(QPen(QColor(MARK), 1.5 * scale))
        for dx, dy in ((1, 0), (-1, 0), (0, 1), (0, -1)):
            way = QPointF(dx, dy) * scale
            painter.drawLine(middle + way * 3.0, middle + way * 9.0)
        painter.setFont(font_of(9, scale))
        painter.setPen(QColor(INK))
        left, right, top, _ = plane.letters
        flag = Qt.AlignmentFlag
        inner = square.adjusted(3, 1, -3, -1)
        centre = flag.AlignVCenter
        painter.drawText(inner, int(flag.AlignLeft | centre), left)
        painter.drawText(inner, int(flag.AlignRight | centre), right)
        painter.drawText(inner, int(flag.AlignTop | flag.AlignHCenter), top)
        name = _TITLES[self.show_kind] if plane is Plane.AXIAL else ""
        painter.drawText(inner, int(flag.AlignBottom | flag.AlignLeft), name)
