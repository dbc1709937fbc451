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


_TICKS = {True: "tick_dark.svg", False: "tick_light.svg"}
LIGHT_FILL = 0.3
"""A box that is ticked is filled with `READY`; so light, it bears a dark tick."""


def take_theme(name: str) -> None:
    """Change all colours to a theme's; what is shown is to be painted anew."""
    COLOURS.follow(THEMES[name])
    OVER.follow(THEMES[name if name == HIGH_CONTRAST else DARK])


class Pixels:
    """Turn designed lengths into those of a scale, as a style sheet writes them."""

    def __init__(self, scale: float) -> None:
        self._scale = scale

    def __call__(self, length: float) -> str:
        return f"{max(round(length * self._scale), 1)}px"


def style_sheet(scale: float) -> str:
    """Return the rules of all that Qt draws itself; scale: on every length."""

    def points(size: float) -> str:
        return f"{size * scale:.1f}pt"

    ground, panel, edge = BACKGROUND.name(), PANEL.name(), EDGE.name()
    ink, quiet, px = INK.name(), QUIET.name(), Pixels(scale)
    return f"""
QMainWindow, QDialog, QWidget#side {{ background: {ground}; }}
QWidget#gauges {{ background: {panel}; border-top: 1px solid {edge}; }}
QWidget#help {{ background: {panel}; border: {px(2)} solid {quiet}; }}
QLabel {{ color: {quiet}; background: transparent; font-size: {points(9.5)}; }}
QLabel#title {{ color: {ink}; font-size: {points(13)}; font-weight: 600; }}
QLabel#caption {{ color: {quiet}; font-size: {points(9)}; }}
QLabel#task {{ color: {ink}; font-size: {points(12)}; font-weight: 600; }}
QLabel#tool {{ color: {ink}; font-size: {points(10.5)}; }}
QLabel#status {{ color: {quiet}; font-size: {points(9)}; }}
QLabel#figure {{ color: {ink}; font-size: {points(13)}; font-weight: 600; }}
QLabel#figure[alarming="true"] {{ color: {ALARM.name()}; }}
QLabel#key {{ color: {ink}; padding-right: {px(6)}; }}
QProgressBar {{ background: {edge}; border: none; }}
QProgressBar::chunk {{ background: {READY.name()}; }}
""" + controls_sheet(scale, points=10.0, room=4)


def controls_sheet(scale: float, *, points: float, room: int) -> str:
    """Return the rules of what one presses, chooses in and types into.

    scale: on every length. points: of texts. room: above and below them, pixels. The
    arrow of a box that drops down is our own: Qt's stays small on a large screen, in a
    frame that only the dark theme hides.
    """
    panel, edge, ink = PANEL.name(), EDGE.name(), INK.name()
    quiet, ready, px = QUIET.name(), READY.name(), Pixels(scale)
    ground = BACKGROUND.name()
    size = f"font-size: {points * scale:.1f}pt;"
    # a thicker frame takes its room from the padding: what it holds stays in place
    thick = (
        f"border: {px(2)} solid {ready}; padding: {px(room - 1)} {px(2 * room - 1)};"
    )
    here = Path(__file__).parent
    tick = (here / _TICKS[READY.lightnessF() > LIGHT_FILL]).as_posix()
    arrow = (here / "arrow_down.svg").as_posix()
    return f"""
QLabel#problem {{
    color: {ink}; background: {panel}; border: {px(2)} solid {CAUTION.name()};
    border-radius: {px(4)}; padding: {px(8)}; font-size: {points * scale:.1f}pt;
}}
QPushButton, QComboBox, QLineEdit {{
    color: {ink}; background: {panel}; border: 1px solid {quiet};
    border-radius: {px(4)}; padding: {px(room)} {px(2 * room)}; {size}
}}
QComboBox {{ padding: {px(room - 1)} {px(2 * room)}; }}
QPushButton:hover {{ border-color: {ink}; }}
QPushButton:checked {{ background: {edge}; border-color: {ready}; }}
QPushButton:focus, QComboBox:focus, QLineEdit:focus {{ {thick}; }}
QComboBox:focus {{ padding: {px(room - 2)} {px(2 * room - 1)}; }}
QPushButton:disabled, QComboBox:disabled {{ color: {quiet}; border-color: {edge}; }}
QPushButton#primary {{
    background: {ready}; color: {BACKGROUND.name()}; border-color: {ready};
    font-weight: 700;
}}
QPushButton#primary:focus {{ border-color: {ink}; }}
QPushButton#primary:disabled {{
    background: {edge}; color: {quiet}; border-color: {edge};
}}
QComboBox::drop-down {{ border: none; width: {px(22)}; }}
QComboBox::down-arrow {{
    image: url("{arrow}"); width: {px(12)}; height: {px(12)};
}}
QComboBox QLineEdit, QComboBox QLineEdit:focus {{ border: none; padding: 0; }}
QComboBox QAbstractItemView {{
    color: {ink}; background: {panel}; selection-background-color: {edge};
    selection-color: {ink};
}}
QTabBar::tab {{
    color: {quiet}; background: {ground}; padding: {px(4)} {px(10)};
    font-size: {points * scale:.1f}pt; border-bottom: {px(2)} solid {ground};
}}
QTabBar::tab:selected {{ color: {ink}; border-bottom-color: {ready}; }}
QTabBar::tab:focus {{ color: {ready}; }}
QTabWidget::pane {{ background: {ground}; border: none; }}
QCheckBox {{ color: {ink}; spacing: {px(8)}; {size} }}
QCheckBox::indicator {{
    width: {px(14)}; height: {px(14)}; background: {panel};
    border: {px(2)} solid {quiet}; border-radius: {px(3)};
}}
QCheckBox::indicator:checked {{
    background: {ready}; border-color: {ready}; image: url("{tick}");
}}
QCheckBox::indicator:disabled {{ border-color: {edge}; }}
QCheckBox::indicator:checked:disabled {{ background: {edge}; }}
QCheckBox:focus {{ color: {ready}; }}
QCheckBox::indicator:focus, QCheckBox::indicator:hover {{ border-color: {ink}; }}
QListWidget, QTreeWidget {{
    color: {ink}; background: {panel}; border: 1px solid {edge}; {size}
}}
QListWidget:focus, QTreeWidget:focus {{ border: 1px solid {ready}; }}
QListWidget::item, QTreeWidget::item {{
    padding: {px(room - 2)} {px(4)}; border: none;
}}
QListWidget::item:selected, QTreeWidget::item:selected {{
    background: {edge}; color: {ink};
}}
QHeaderView::section {{
    color: {quiet}; background: {panel}; border: none;
    padding: {px(room - 2)} {px(2)} {px(room - 2)} {px(7)};
    font-size: {(points - 1) * scale:.1f}pt;
}}
QScrollBar {{ background: {panel}; width: {px(10)}; height: {px(10)}; }}
QScrollBar::handle {{
    background: {quiet}; border-radius: {px(3)}; margin: {px(2)};
    min-height: {px(24)}; min-width: {px(24)};
}}
QScrollBar::handle:hover {{ background: {ink}; }}
QScrollBar::add-line, QScrollBar::sub-line {{ width: 0; height: 0; }}
QScrollBar::add-page, QScrollBar::sub-page {{ background: none; }}
"""


def font_of(points: float, scale: float, *, bold: bool = False) -> QFont:
    """Return a font for painting, its size in points at scale 1."""
    font = QFont()
    font.setPointSizeF(points * scale)
    font.setBold(bold)
    return font
