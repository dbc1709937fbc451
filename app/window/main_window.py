"""The main window: a frame for one page at a time, its size, and its end."""

import os
from pathlib import Path
from threading import Thread

import msgspec
from PySide6.QtCore import Qt, QTimer, Signal
from PySide6.QtGui import (
    QCloseEvent,
    QDragEnterEvent,
    QDropEvent,
    QKeyEvent,
    QKeySequence,
    QResizeEvent,
    QShortcut,
)
from PySide6.QtWidgets import QApplication, QMainWindow, QMessageBox, QStackedWidget

from app.window.ending import wait_for
from app.window.keyboard.actions import Act
from app.window.keyboard.key_map import KEYS
from app.window.page import Page, TextPage
from app.window.plain_label import warning_box
from app.window.scaling import scale_all
from app.window.settings_dialog import SettingsDialog
from app.window.style import style_sheet, take_theme
from app.window.texts import take_language, tr
from app.window.themes import DARK, THEMES
from app.window.window_size import LEAST, FullScreen, first_size, scale_for
from paravol.trainee.window_preferences import WindowPreferences, write_preferences
from system import UserError


class MainWindow(QMainWindow):
    """Show one page. Lives in the thread that made it, as all of Qt's widgets do."""

    dropped = Signal(object)
    """Paths of local files and folders that were dropped on whatever page is shown."""

    def __init__(
        self,
        screenshot: Path | None = None,
        preferences: WindowPreferences | None = None,
    ) -> None:
        """Show nothing yet.

        screenshot: PNG file for a picture when it closes. preferences: theme and size
        of texts; None for the first ones.
        """
        super().__init__()
        self._pages = QStackedWidget()
        self._page = Page()
        self._pages.addWidget(self._page)
        self._may_close = False
        self._told: QMessageBox | None = None
        self._endings: list[Thread] = []
        self._scale = 0.0
        self._preferences = WindowPreferences()
        self._screenshot = screenshot
        self.full_screen = FullScreen(self)
        self.setCentralWidget(self._pages)
        self.setAcceptDrops(True)
        # Python gets to its signals only when Qt calls it: Ctrl-C waits so long.
        self._timer = QTimer(self)
        self._timer.timeout.connect(lambda: None)
        self._timer.start(100)
        QShortcut(QKeySequence("Ctrl+Q"), self).activated.connect(self.close)
        # else it could not become smaller than what its last scale needs
        self.setMinimumSize(LEAST / self.devicePixelRatioF())
        size = first_size(self.screen().availableGeometry().size())
        self.resize(size)
        self.take_preferences(preferences or WindowPreferences())

    @property
    def page(self) -> Page:
        """Return the page that is shown."""
        return self._page

    @property
    def scale(self) -> float:
        """Return the factor on every font and length."""
        return self._scale

    def show_page(self, page: Page) -> None:
        """Show a page; the one before is released, and ends beside the window."""
        before, self._page = self._page, page
        page.full_screen_wanted.connect(self.full_screen.switch)
        page.set_scale(self._scale)
        self._pages.addWidget(page)
        self._pages.setCurrentWidget(page)
        self._pages.removeWidget(before)
        living = [ending for ending in self._endings if ending.is_alive()]
        self._endings = [*living, *before.release()]
        before.deleteLater()
        self.setWindowTitle(page.title)
        page.setFocus()

    def take_preferences(self, chosen: WindowPreferences) -> None:
        """Take looks, mouse and keys; a theme that is not known is the first."""
        if chosen.theme not in THEMES:
            chosen = msgspec.structs.replace(chosen, theme=DARK)
        self._preferences = chosen
        take_theme(chosen.theme)
        take_language(chosen.language)
        KEYS.follow(chosen)
        self._scale = 0.0
        self._set_scale()

    def show_settings(self) -> None:
        """Ask for looks, mouse and keys, and keep what is chosen."""
        dialog = SettingsDialog(self._preferences, self)
        scale_all(dialog, self._scale)
        dialog.chosen.connect(self.take_preferences)
        dialog.accepted.connect(self._keep_preferences)
        self._page.covered(True)
        # the page of now: another may be shown meanwhile
        dialog.finished.connect(lambda _: self._page.covered(False))
        dialog.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        dialog.open()

    def _keep_preferences(self) -> None:
        try:
            write_preferences(self._preferences)
        except UserError as error:
            warning_box(tr("Settings"), str(error), self).exec()

    def tell(self, problem: str) -> None:
        """Tell what went wrong outside of any page's work; the window stays."""
        page = self._page
        if isinstance(page, TextPage):
            page.say(problem)
        elif self._told is None:
            self._told = warning_box("PARAVOL", problem, self)
            self._told.finished.connect(self._forget_told)
            self._told.open()

    def _forget_told(self) -> None:
        self._told = None

    def _set_scale(self) -> None:
        fitting = scale_for(self.size(), self.devicePixelRatioF())
        scale = fitting * self._preferences.font_scale
        if scale != self._scale:
            self._scale = scale
            self.setStyleSheet(style_sheet(scale))
            self._page.set_scale(scale)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Open the settings on F2, on every page that has no other use for the key."""
        if KEYS.action(event) is Act.SETTINGS:
            self.show_settings()
        else:
            super().keyPressEvent(event)

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Draw everything as large as the window has room for."""
        super().resizeEvent(event)
        self._set_scale()

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
        """Release the page that is shown; wait a while for what ends of all pages."""
        wait_for([*self._endings, *self._page.release()])

    def _save(self, path: Path) -> None:
        self._page.catch_up()
        partial = path.with_name(f".{path.stem}.{os.getpid()}.partial.png")
        if not self.grab().save(str(partial)):
            raise UserError(tr("The screenshot {path} cannot be written.", path=path))
        os.replace(partial, path)
