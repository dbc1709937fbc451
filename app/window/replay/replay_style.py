"""Rules for what the replay page has that a flight's page has not."""

from PySide6.QtGui import QColor

from app.window.style import (
    BACKGROUND,
    CAUTION,
    EDGE,
    INK,
    PANEL,
    QUIET,
    READY,
    drop_down_rules,
)


def replay_sheet(scale: float) -> str:
    """Return the rules; scale: on every length."""

    def pt(size: float) -> str:
        return f"{size * scale:.1f}pt"

    def px(size: float) -> str:
        return f"{max(round(size * scale), 1)}px"

    ground, panel, edge, ink, quiet, ready, caution = (
        QColor(colour).name()
        for colour in (BACKGROUND, PANEL, EDGE, INK, QUIET, READY, CAUTION)
    )
    return f"""
QWidget#side {{ background: {ground}; }}
QLabel#clock {{ color: {ink}; font-size: {pt(11)}; font-weight: 600; }}
QLabel#problem {{
    color: {ink}; background: {panel}; border: {px(2)} solid {caution};
    border-radius: {px(4)}; padding: {px(8)}; font-size: {pt(10.5)};
}}
QPushButton, QComboBox, QLineEdit {{
    color: {ink}; background: {panel}; border: 1px solid {quiet};
    border-radius: {px(4)}; padding: {px(3)} {px(8)}; font-size: {pt(9.5)};
}}
QPushButton:hover {{ border-color: {ink}; }}
QPushButton:checked {{ background: {edge}; border-color: {ready}; }}
QPushButton:disabled, QComboBox:disabled {{ color: {quiet}; border-color: {edge}; }}
QPushButton:focus, QComboBox:focus, QLineEdit:focus {{
    border: {px(2)} solid {ready};
}}
QComboBox QAbstractItemView {{
    color: {ink}; background: {panel}; selection-background-color: {edge};
}}
QTabBar::tab {{
    color: {quiet}; background: {ground}; padding: {px(4)} {px(10)};
    font-size: {pt(9.5)}; border-bottom: {px(2)} solid {ground};
}}
QTabBar::tab:selected {{ color: {ink}; border-bottom-color: {ready}; }}
QTabBar::tab:focus {{ color: {ready}; }}
QTabWidget::pane {{ border: none; }}
QListWidget, QTreeWidget {{
    color: {ink}; background: {panel}; border: 1px solid {edge};
    font-size: {pt(9.5)};
}}
QListWidget:focus, QTreeWidget:focus {{ border: 1px solid {ready}; }}
QListWidget::item, QTreeWidget::item {{ padding: {px(2)}; }}
QListWidget::item:selected, QTreeWidget::item:selected {{
    background: {edge}; color: {ink};
}}
QHeaderView::section {{
    color: {quiet}; background: {panel}; border: none; padding: {px(3)};
    font-size: {pt(9)};
}}
QScrollBar:vertical {{ background: {panel}; width: {px(8)}; }}
QScrollBar:horizontal {{ background: {panel}; height: {px(8)}; }}
QScrollBar::handle {{ background: {quiet}; }}
QScrollBar::add-line, QScrollBar::sub-line {{ width: 0; height: 0; }}
""" + drop_down_rules(scale)
