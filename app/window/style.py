"""The window's colours and fonts, those of the theme that is chosen.

The colours are there under fixed names and change in place when another theme is
chosen: whoever paints takes them anew each time, and a text of them is ``INK.name()``.
"""

from pathlib import Path

from PySide6.QtGui import QColor, QFont

from app.window.themes import DARK, HIGH_CONTRAST, THEMES, Theme


class Colours:
    """The colours of a theme; see `Theme` for what each is for."""

    def __init__(self, theme: Theme) -> None:
        self.background = QColor(theme.background)
        self.panel = QColor(theme.panel)
        self.edge = QColor(theme.edge)
        self.ink = QColor(theme.ink)
        self.quiet = QColor(theme.quiet)
        self.ready = QColor(theme.ready)
        self.caution = QColor(theme.caution)
        self.warning = QColor(theme.warning)
        self.alarm = QColor(theme.alarm)

    def follow(self, theme: Theme) -> None:
        """Take on another theme's colours, in place."""
        for name, colour in vars(self).items():
            colour.setRgb(QColor(getattr(theme, name)).rgb())


COLOURS = Colours(THEMES[DARK])
"""Of the window."""

OVER = Colours(THEMES[DARK])
"""Over pictures, which are dark in every theme."""

BACKGROUND = COLOURS.background
PANEL = COLOURS.panel
EDGE = COLOURS.edge
INK = COLOURS.ink
QUIET = COLOURS.quiet
READY = COLOURS.ready
CAUTION = COLOURS.caution
WARNING = COLOURS.warning
ALARM = COLOURS.alarm


def take_theme(name: str) -> None:
    """Change all colours to a theme's; what is shown is to be painted anew."""
    COLOURS.follow(THEMES[name])
    OVER.follow(THEMES[name if name == HIGH_CONTRAST else DARK])


def style_sheet(scale: float) -> str:
    """Return the rules of all that Qt draws itself; scale: on every length."""

    def points(size: float) -> str:
        return f"{size * scale:.1f}pt"

    def pixels(size: float) -> str:
        return f"{max(round(size * scale), 1)}px"

    ground, panel, edge = BACKGROUND.name(), PANEL.name(), EDGE.name()
    ink, quiet, ready = INK.name(), QUIET.name(), READY.name()
    return f"""
QMainWindow, QDialog, QWidget#side {{ background: {ground}; }}
QWidget#gauges {{ background: {panel}; border-top: 1px solid {edge}; }}
QWidget#help {{ background: {panel}; border: {pixels(2)} solid {quiet}; }}
QLabel {{ color: {quiet}; background: transparent; font-size: {points(9.5)}; }}
QLabel#title {{ color: {ink}; font-size: {points(13)}; font-weight: 600; }}
QLabel#caption {{ color: {quiet}; font-size: {points(9)}; }}
QLabel#task {{ color: {ink}; font-size: {points(12)}; font-weight: 600; }}
QLabel#tool {{ color: {ink}; font-size: {points(10.5)}; }}
QLabel#status {{ color: {quiet}; font-size: {points(9)}; }}
QLabel#figure {{ color: {ink}; font-size: {points(13)}; font-weight: 600; }}
QLabel#figure[alarming="true"] {{ color: {ALARM.name()}; }}
QLabel#key {{ color: {ink}; padding-right: {pixels(6)}; }}
QProgressBar {{ background: {edge}; border: none; }}
QProgressBar::chunk {{ background: {ready}; }}
QPushButton, QComboBox {{
    color: {ink}; background: {panel}; font-size: {points(10)};
    border: 1px solid {quiet}; padding: {pixels(4)} {pixels(10)};
}}
QComboBox QAbstractItemView {{ color: {ink}; background: {panel}; }}
QPushButton:focus, QComboBox:focus {{
    border: {pixels(2)} solid {ready};
}}
""" + drop_down_rules(scale)


def drop_down_rules(scale: float) -> str:
    """Return a style sheet's rules for the arrow of a box that drops down.

    scale: on its size. Qt's own arrow stays small on a large screen, in a frame that
    only the dark theme hides.
    """
    arrow = (Path(__file__).parent / "arrow_down.svg").as_posix()
    wide, size = max(round(22 * scale), 1), max(round(12 * scale), 1)
    return f"""
QComboBox::drop-down {{ border: none; width: {wide}px; }}
QComboBox::down-arrow {{ image: url("{arrow}"); width: {size}px; height: {size}px; }}
"""


def font_of(points: float, scale: float, *, bold: bool = False) -> QFont:
    """Return a font for painting, its size in points at scale 1."""
    font = QFont()
    font.setPointSizeF(points * scale)
    font.setBold(bold)
    return font
