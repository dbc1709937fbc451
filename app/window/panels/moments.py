"""Kept moments in the window, side by side, while and after they are drawn."""

from pathlib import Path

from PySide6.QtCore import QPointF, QRectF, Qt, Signal, Slot
from PySide6.QtGui import (
    QImage,
    QKeyEvent,
    QMouseEvent,
    QPainter,
    QPaintEvent,
    QWheelEvent,
)
from PySide6.QtWidgets import QDialog, QWidget

from app.window.panels.qt_image import image_of
from app.window.scaling import Scaled, hold
from app.window.style import ALARM, BACKGROUND, EDGE, INK, QUIET, READY, font_of
from app.window.texts import tr
from paravol.snapshots.snapshot_queue import MomentPicture

HEIGHT_PX = 120
CAPTION_PX = 44.0
_GAP_PX = 8.0
_BAR_PX = 4.0

MOST_MOMENTS = 24
"""Kept in the strip; older ones are in the recording's folder."""


class MomentView(QWidget, Scaled):
    """Show the snapshots of kept moments, the newest first; a click enlarges one.

    Hidden until a moment is kept.
    """

    def __init__(self) -> None:
        super().__init__()
        hold(self, setFixedHeight=HEIGHT_PX)
        self.setAttribute(Qt.WidgetAttribute.WA_OpaquePaintEvent)
        self.setCursor(Qt.CursorShape.PointingHandCursor)
        self.hide()
        self._pictures: dict[float, MomentPicture] = {}
        self._images: dict[float, QImage] = {}
        self._first = 0
        self.enlarged: EnlargedMoment | None = None

    @property
    def times_s(self) -> list[float]:
        """Return the times of the moments in the strip, the newest first."""
        return list(reversed(self._pictures))

    @property
    def caption(self) -> tuple[str, str]:
        """Return what is said of the newest moment: a title and a line of detail."""
        times = self.times_s
        return caption_of(self._pictures[times[0]]) if times else ("", "")

    @Slot(object)
    def show_moment(self, picture: MomentPicture) -> None:
        """Take a picture; one without pixels leaves those of its moment standing."""
        at_s = picture.time_s
        self._pictures[at_s] = picture
        if picture.pixels is not None:
            self._images[at_s] = image_of(picture.pixels)
        while len(self._pictures) > MOST_MOMENTS:
            oldest = next(iter(self._pictures))
            if self.enlarged is not None and self.enlarged.time_s == oldest:
                self.enlarged.close()
            del self._pictures[oldest]
            self._images.pop(oldest, None)
        title, detail = self.caption
        self.setAccessibleName(f"{title}, {detail}")
        self.setToolTip(tr("Kept moments: a click enlarges one, the wheel shows more."))
        if self.enlarged is not None and self.enlarged.time_s == at_s:
            self.enlarged.show_image(self._images.get(at_s), caption_of(picture))
        self.show()
        self.update()

    def enlarge(self, time_s: float) -> None:
        """Show a moment in a window of its own, which goes on growing."""
        if self.enlarged is None:
            self.enlarged = EnlargedMoment(self.window())
            self.enlarged.stepped.connect(self._step)
        self.enlarged.time_s = time_s
        picture = self._pictures[time_s]
        self.enlarged.show_image(self._images.get(time_s), caption_of(picture))
        self.enlarged.show()

    @Slot(int)
    def _step(self, by: int) -> None:
        """Enlarge the moment that lies so many places on in the strip."""
        if self.enlarged is not None:
            times = self.times_s
            self.enlarge(times[(times.index(self.enlarged.time_s) + by) % len(times)])

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Enlarge the moment that was clicked."""
        for time_s, square in self._squares():
            if square.contains(event.position()):
                self.enlarge(time_s)
                return

    def wheelEvent(self, event: QWheelEvent) -> None:
        """Go on to older moments, and back."""
        step = -1 if event.angleDelta().y() > 0 else 1
        self._first = min(max(self._first + step, 0), max(len(self._pictures) - 1, 0))
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        """Paint the pictures, their names and how far they are."""
        painter = QPainter(self)
        painter.fillRect(self.rect(), BACKGROUND)
        painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform)
        for time_s, square in self._squares():
            painter.fillRect(square, Qt.GlobalColor.black)
            if time_s in self._images:
                painter.drawImage(square, self._images[time_s])
            self._paint_caption(painter, self._pictures[time_s], square)
        painter.end()

    def _squares(self) -> list[tuple[float, QRectF]]:
        """Return where each moment's picture stands, as far as there is room."""
        edge = self.height() - CAPTION_PX * self.scale
        wide = max(edge, 90.0 * self.scale) + _GAP_PX * self.scale
        count = max(int((self.width() + _GAP_PX * self.scale) / wide), 1)
        shown = self.times_s[self._first : self._first + count]
        return [
            (time_s, QRectF(place * wide, 0.0, edge, edge))
            for place, time_s in enumerate(shown)
        ]

    def _paint_caption(
        self, painter: QPainter, picture: MomentPicture, square: QRectF
    ) -> None:
        scale = self.scale
        wide = max(square.width(), 90.0 * scale)
        line = QRectF(square.left(), square.bottom() + 6.0 * scale, wide, 18.0 * scale)
        flags = int(Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter)
        painter.setFont(font_of(9, scale, bold=True))
        painter.setPen(INK)
        painter.drawText(line, flags, f"{picture.time_s:.1f} s")
        failed = picture.done is None and picture.pixels is None
        painter.setFont(font_of(9, scale))
        painter.setPen(ALARM if failed else QUIET)
        line.translate(0.0, 17.0 * scale)
        painter.drawText(line, flags, short_of(picture))
        if picture.done is not None:
            bar = QRectF(
                square.left(), square.bottom(), square.width(), _BAR_PX * scale
            )
            painter.fillRect(bar, EDGE)
            bar.setWidth(bar.width() * min(max(picture.done, 0.0), 1.0))
            painter.fillRect(bar, READY)


class EnlargedMoment(QDialog):
    """Show one kept moment as large as its window is; Esc or a click closes it."""

    stepped = Signal(int)
    """Another one is wanted: so many places on."""

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self.time_s = 0.0
        self._image = QImage()
        self._caption = "", ""
        edge = min(parent.width(), parent.height()) * 3 // 4
        self.resize(edge, edge)
        self.setAttribute(Qt.WidgetAttribute.WA_OpaquePaintEvent)

    def show_image(self, image: QImage | None, caption: tuple[str, str]) -> None:
        """Take a picture, None for none yet, and what is said of it."""
        self._image = QImage() if image is None else image
        self._caption = caption
        self.setWindowTitle(caption[0])
        self.setAccessibleName(", ".join(caption))
        self.update()

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Close."""
        self.close()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Close with Enter or the space bar, too; the arrows show the others."""
        match event.key():
            case Qt.Key.Key_Return | Qt.Key.Key_Enter | Qt.Key.Key_Space:
                self.close()
            case Qt.Key.Key_Left:
                self.stepped.emit(-1)
            case Qt.Key.Key_Right:
                self.stepped.emit(1)
            case _:
                super().keyPressEvent(event)

    def paintEvent(self, event: QPaintEvent) -> None:
        """Paint the picture and what is said of it."""
        painter = QPainter(self)
        painter.fillRect(self.rect(), Qt.GlobalColor.black)
        painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform)
        room = float(min(self.width(), self.height() - 40))
        if not self._image.isNull():
            corner = QPointF((self.width() - room) / 2.0, 0.0)
            painter.drawImage(QRectF(corner.x(), 0.0, room, room), self._image)
        painter.setFont(font_of(10, 1.0))
        painter.setPen(Qt.GlobalColor.white)
        line = QRectF(0.0, self.height() - 36.0, self.width(), 32.0)
        painter.drawText(line, int(Qt.AlignmentFlag.AlignCenter), self._caption[1])
        painter.end()


def caption_of(picture: MomentPicture) -> tuple[str, str]:
    """Return what is said of a moment: a title and a line of detail."""
    title = tr("Moment at {time_s:.1f} s", time_s=picture.time_s)
    if picture.done is not None:
        return title, tr("being drawn: {done:.0%}", done=picture.done)
    if picture.pixels is None:
        return title, picture.message
    detail = tr("saved as snapshots/{name}", name=Path(picture.message).name)
    if picture.rmse is not None:
        detail += tr(" · live picture off by {rmse:.1f} of 255", rmse=picture.rmse)
    return title, detail


def short_of(picture: MomentPicture) -> str:
    """Return the same in a few words, for below a small picture."""
    if picture.done is not None:
        return (
            tr("{done:.0%} drawn", done=picture.done)
            if picture.done > 0.0
            else tr("waits")
        )
    if picture.pixels is None:
        return tr("failed")
    return (
        tr("saved")
        if picture.rmse is None
        else tr("live ±{rmse:.1f}/255", rmse=picture.rmse)
    )
