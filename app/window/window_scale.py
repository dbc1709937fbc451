"""How large a window is at first, and how large what it shows is drawn in it."""

from PySide6.QtCore import QSize
from PySide6.QtGui import QFont

DESIGNED = QSize(1280, 800)
"""At this size of the window everything has its own size."""

SCALES = (0.85, 6.0)
"""Smaller nobody can read it; larger there is no screen."""

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


def scale_for(window: QSize) -> float:
    """Return the factor on every font and fixed length in a window of this size."""
    share = min(window.width() / DESIGNED.width(), window.height() / DESIGNED.height())
    low, high = SCALES
    return min(max(int(share / _STEP + 1e-6) * _STEP, low), high)


def font_of(points: float, scale: float, *, bold: bool = False) -> QFont:
    """Return a font for painting, its size in points at scale 1."""
    font = QFont()
    font.setPointSizeF(points * scale)
    font.setBold(bold)
    return font
