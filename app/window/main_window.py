"""The main window: a frame for one page at a time, its size, and its end."""

import os
from pathlib import Path

from PySide6.QtCore import QTimer, Signal
from PySide6.QtGui import QCloseEvent, QDragEnterEvent, QDropEvent, QResizeEvent
from PySide6.QtWidgets import QApplication, QMainWindow, QStackedWidget

from app.window.page import Page
from app.window.style import style_sheet
from app.window.window_size import FullScreen, first_size, scale_for
from disk import UserError


class MainWindow(QMainWindow):
    """Show one page. Lives in the thread that made it, as all of Qt's widgets do."""

    dropped = Signal(object)
    """Paths of local files and folders that were dropped on whatever page is shown."""

    def __init__(self, screenshot: Path | None = None) -> None:
        """Show nothing yet; screenshot: PNG file for a picture when it closes."""
        super().__init__()
        self._pages = QStackedWidget()
        self._page = Page()
        self._pages.addWidget(self._page)
        self._may_close = False
        self._scale = 0.0
        self._screenshot = screenshot
        self.full_screen = FullScreen(self)
        self.setCentralWidget(self._pages)
        self.setAcceptDrops(True)
        # Python gets to its signals only when Qt calls it: Ctrl-C waits so long.
        self._timer = QTimer(self)
        self._timer.timeout.connect(lambda: None)
        self._timer.start(100)
        size = first_size(self.screen().availableGeometry().size())
        self._set_scale(scale_for(size))
        self.resize(size)

    @property
    def page(self) -> Page:
        """Return the page that is shown."""
        return self._page

    @property
    def scale(self) -> float:
        """Return the factor on every font and length."""
        return self._scale

    def show_page(self, page: Page) -> None:
        """Show a page; the one before is released."""
        before, self._page = self._page, page
        page.set_scale(self._scale)
        self._pages.addWidget(page)
        self._pages.setCurrentWidget(page)
        self._pages.removeWidget(before)
        before.release()
        before.deleteLater()
        self.setWindowTitle(page.title)
        page.setFocus()

    def _set_scale(self, scale: float) -> None:
        if scale != self._scale:
            self._scale = scale
            self.setStyleSheet(style_sheet(scale))
            self._page.set_scale(scale)

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Draw everything as large as the window has room for."""
        super().resizeEvent(event)
        self._set_scale(scale_for(event.size()))

    def dragEnterEvent(self, event: QDragEnterEvent) -> None:
        """Take what has local files."""
        if any(url.isLocalFile() for url in event.mimeData().urls()):
            event.acceptProposedAction()

    def dropEvent(self, event: QDropEvent) -> None:
        """Tell which files and folders were dropped."""
        urls = event.mimeData().urls()
        paths = [Path(url.toLocalFile()) for url in urls if url.isLocalFile()]
        if paths:
            event.acceptProposedAction()
            self.dropped.emit(paths)

    def closeEvent(self, event: QCloseEvent) -> None:
        """End the program's event loop, unless the page has something to ask."""
        if not self._may_close and not self._page.may_leave():
            event.ignore()
            return
        self._timer.stop()
        screenshot, self._screenshot = self._screenshot, None
        if screenshot is not None:
            self._save(screenshot)
        super().closeEvent(event)
        QApplication.quit()

    def shut(self) -> None:
        """Close without asking."""
        self._may_close = True
        self.close()

    def release(self) -> None:
        """Release the page that is shown."""
        self._page.release()

    def _save(self, path: Path) -> None:
        self._page.catch_up()
        partial = path.with_name(f".{path.stem}.{os.getpid()}.partial.png")
        if not self.grab().save(str(partial)):
            raise UserError(f"The screenshot {path} cannot be written.")
        os.replace(partial, path)
