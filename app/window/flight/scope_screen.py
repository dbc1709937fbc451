"""A window that shows only the scope's picture, for a second screen."""

from collections.abc import Sequence

from PySide6.QtCore import QCoreApplication, Qt, Signal
from PySide6.QtGui import (
    QCloseEvent,
    QGuiApplication,
    QKeyEvent,
    QPainter,
    QPaintEvent,
    QScreen,
)
from PySide6.QtWidgets import QWidget

from app.window.keyboard.actions import Act
from app.window.keyboard.key_map import KEYS
from app.window.panels.endoscope_panel import PictureView, picture_square
from app.window.texts import tr
from app.window.window_size import scale_for


def other_screen(own: QScreen, screens: Sequence[QScreen]) -> QScreen:
    """Return a screen that a window is not on; its own where there is no other."""
    return next((screen for screen in screens if screen is not own), own)


class ScopeScreen(QWidget):
    """Mirror a picture without a frame, with its alarms and captions.

    It paints what the picture has, nothing is drawn a second time. Its keys go to the
    page.
    """

    closed = Signal()

    def __init__(self, picture: PictureView, page: QWidget) -> None:
        super().__init__(None, Qt.WindowType.Window | Qt.WindowType.FramelessWindowHint)
        self.setWindowTitle(tr("PARAVOL: the scope's picture"))
        self.setAttribute(Qt.WidgetAttribute.WA_OpaquePaintEvent)
        self.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        self._picture = picture
        self._page = page
        picture.changed.connect(self.update)

    @property
    def edge_px(self) -> int:
        """Return the edge of the round picture, in the screen's pixels."""
        edge = picture_square(self.rect()).width()
        return round(edge * self.devicePixelRatioF())

    def fill(self) -> str:
        """Fill another screen, or the only one; say which."""
        screens = QGuiApplication.screens()
        screen = other_screen(self._page.screen(), screens)
        self.setScreen(screen)
        self.setGeometry(screen.geometry())
        self.showFullScreen()
        # without a window manager nothing else does it
        self.setGeometry(screen.geometry())
        if screen is self._page.screen():
            return tr(
                "There is one screen only: {key} takes the picture away again",
                key=KEYS.label(Act.SECOND_SCREEN),
            )
        return tr("The scope's picture fills {name}", name=screen.name())

    def paintEvent(self, event: QPaintEvent) -> None:
        """Paint what the picture shows."""
        painter = QPainter(self)
        scale = scale_for(self.size(), self.devicePixelRatioF())
        self._picture.paint(painter, self.rect(), scale)
        painter.end()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Close on Escape; leave all else to the page."""
        if event.key() == Qt.Key.Key_Escape:
            self.close()
        else:
            QCoreApplication.sendEvent(self._page, event)

    def keyReleaseEvent(self, event: QKeyEvent) -> None:
        """Leave it to the page."""
        QCoreApplication.sendEvent(self._page, event)

    def closeEvent(self, event: QCloseEvent) -> None:
        """Tell that it is closed."""
        self.closed.emit()
        super().closeEvent(event)
