"""A kept moment in the window, while and after it is drawn at high quality."""

from pathlib import Path

from PySide6.QtCore import QRectF, Qt, Slot
from PySide6.QtGui import QImage, QPainter, QPaintEvent
from PySide6.QtWidgets import QWidget

from app.window.panels.qt_image import image_of
from app.window.style import ALARM, BACKGROUND, EDGE, INK, QUIET, READY, font_of
from paravol.snapshots.snapshot_queue import MomentPicture

HEIGHT_PX = 120
_BAR_PX = 4.0


class MomentView(QWidget):
    """Show the snapshot that is being drawn; hidden until a moment is kept."""

    def __init__(self) -> None:
        super().__init__()
        self._scale = 1.0
        self.setFixedHeight(HEIGHT_PX)
        self.setAttribute(Qt.WidgetAttribute.WA_OpaquePaintEvent)
        self.hide()
        self._image = QImage()
        self._picture: MomentPicture | None = None

    def set_scale(self, scale: float) -> None:
        """Scale the layout; 1 is the designed size."""
        self._scale = scale
        self.setFixedHeight(round(HEIGHT_PX * scale))

    @property
    def caption(self) -> tuple[str, str]:
        """Return what is written beside the picture: a title and a line of detail."""
        picture = self._picture
        if picture is None:
            return "", ""
        title = f"Moment at {picture.time_s:.1f} s"
        if picture.done is not None:
            return title, f"being drawn: {picture.done:.0%}"
        if picture.pixels is None:
            return title, picture.message
        return title, f"saved as snapshots/{Path(picture.message).name}"

    @Slot(object)
    def show_moment(self, picture: MomentPicture) -> None:
        """Take a picture; one without pixels leaves those of its moment standing."""
        before = self._picture
        if before is not None and before.time_s != picture.time_s:
            self._image = QImage()
        if picture.pixels is not None:
            self._image = image_of(picture.pixels)
        self._picture = picture
        self.show()
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        """Paint the picture, its name and how far it is."""
        painter = QPainter(self)
        painter.fillRect(self.rect(), BACKGROUND)
        painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform)
        edge = float(self.height())
        square = QRectF(0.0, 0.0, edge, edge)
        painter.fillRect(square, Qt.GlobalColor.black)
        if not self._image.isNull():
            painter.drawImage(square, self._image)
        picture = self._picture
        if picture is not None:
            self._paint_caption(painter, picture, edge + 14.0 * self._scale)
        painter.end()

    def _paint_caption(
        self, painter: QPainter, picture: MomentPicture, left: float
    ) -> None:
        title, detail = self.caption
        scale = self._scale
        box = QRectF(left, 8.0 * scale, self.width() - left, self.height())
        wrap = int(Qt.AlignmentFlag.AlignTop | Qt.TextFlag.TextWordWrap)
        painter.setFont(font_of(11, scale, bold=True))
        painter.setPen(INK)
        painter.drawText(box, wrap, title)
        painter.setFont(font_of(10, scale))
        failed = picture.done is None and picture.pixels is None
        painter.setPen(ALARM if failed else QUIET)
        painter.drawText(box.adjusted(0.0, 24.0 * scale, 0.0, 0.0), wrap, detail)
        if picture.done is not None:
            width = max(box.width() - 8.0 * scale, 0.0)
            bar = QRectF(left, 62.0 * scale, width, _BAR_PX * scale)
            painter.fillRect(bar, EDGE)
            bar.setWidth(bar.width() * min(max(picture.done, 0.0), 1.0))
            painter.fillRect(bar, READY)
