"""How large a window is, and how large what it shows is drawn in it."""

from PySide6.QtCore import QRect, QSize
from PySide6.QtWidgets import QWidget

DESIGNED = QSize(1280, 800)
"""At this size of the window everything has its own size."""

SCALES = (0.85, 6.0)
"""Smaller is unreadable on a screen whose pixels Qt does not scale; no screen needs
larger."""

LEAST = QSize(640, 480)
"""Nobody can fly in a smaller window."""

_STEP = 0.05
"""Between two scales: laying out anew for each pixel would make a drag slow."""

_LEFT_FREE = 0.85
"""Of a large screen the window takes this share, of a small one all."""

_FRAME = QSize(8, 40)
"""What a desktop puts round a window."""


def first_size(available: QSize) -> QSize:
    """Return a size that fits a screen with this room, and makes use of it."""
    most = available - _FRAME
    wanted = (available * _LEFT_FREE).expandedTo(DESIGNED)
    return wanted.boundedTo(most)


def scale_for(window: QSize, pixel_ratio: float = 1.0) -> float:
    """Return the factor on every font and fixed length in a window of this size.

    pixel_ratio: the screen's pixels to one of Qt's.
    """
    share = min(window.width() / DESIGNED.width(), window.height() / DESIGNED.height())
    low, high = SCALES
    return min(max(int(share / _STEP + 1e-6) * _STEP, low / pixel_ratio), high)


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
        # Without a window manager nothing else does it; afterwards it would end the
        # state of filling the screen.
        window.setGeometry(window.screen().geometry())
        window.showFullScreen()
