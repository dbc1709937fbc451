"""A window that fills the screen, or is as large as before."""

from PySide6.QtCore import QRect
from PySide6.QtWidgets import QWidget


class FullScreen:
    """Switch a window between its own size and the screen's."""

    def __init__(self, window: QWidget) -> None:
        self._window = window
        self._left = QRect()

    def switch(self) -> None:
        """Fill the screen, or go back to the size that was left."""
        window = self._window
        if window.isFullScreen():
            window.showNormal()
            window.setGeometry(self._left)
            return
        self._left = window.geometry()
        window.showFullScreen()
        # Where there is no window manager, nobody else does it.
        window.setGeometry(window.screen().geometry())
