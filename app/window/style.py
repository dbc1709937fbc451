"""The window's colours and fonts: dark, because the picture is what one looks at."""

from PySide6.QtGui import QFont

BACKGROUND = "#0d1117"
PANEL = "#161b22"
EDGE = "#262c34"
INK = "#f0f3f6"
QUIET = "#9aa4af"
READY = "#4cc9a0"
ALARM = "#ff4d5e"

# Of a palette that is told apart with every kind of colour vision (Okabe and Ito).
CAUTION = "#e69f00"
WARNING = "#d55e00"


def style_sheet(scale: float) -> str:
    """Return the rules of all that Qt draws itself; scale: on every length."""

    def points(size: float) -> str:
        return f"{size * scale:.1f}pt"

    return f"""
QMainWindow, QWidget#side {{ background: {BACKGROUND}; }}
QWidget#gauges {{ background: {PANEL}; border-top: 1px solid {EDGE}; }}
QLabel {{ color: {QUIET}; background: transparent; font-size: {points(9.5)}; }}
QLabel#title {{ color: {INK}; font-size: {points(13)}; font-weight: 600; }}
QLabel#caption {{ color: {QUIET}; font-size: {points(9)}; }}
QLabel#task {{ color: {INK}; font-size: {points(11)}; }}
QProgressBar {{ background: {EDGE}; border: none; }}
QProgressBar::chunk {{ background: {READY}; }}
QLabel#figure {{ color: {INK}; font-size: {points(16)}; font-weight: 600; }}
QLabel#figure[alarming="true"] {{ color: {ALARM}; }}
QLabel#key {{ color: {INK}; padding-right: {round(6 * scale)}px; }}
"""


def font_of(points: float, scale: float, *, bold: bool = False) -> QFont:
    """Return a font for painting, its size in points at scale 1."""
    font = QFont()
    font.setPointSizeF(points * scale)
    font.setBold(bold)
    return font
