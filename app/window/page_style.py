"""Rules for pages of text, lists and buttons, in the window's colours."""

from app.window.style import (
    ALARM,
    BACKGROUND,
    CAUTION,
    EDGE,
    INK,
    PANEL,
    QUIET,
    READY,
)


def page_sheet(scale: float) -> str:
    """Return the rules; scale: on every length."""

    def pt(size: float) -> str:
        return f"{size * scale:.1f}pt"

    def px(size: float) -> str:
        return f"{max(round(size * scale), 1)}px"

    return f"""
QWidget#page {{ background: {BACKGROUND}; }}
QFrame#card {{
    background: {PANEL}; border: 1px solid {EDGE}; border-radius: {px(6)};
}}
QFrame#card[marked="true"] {{ border: {px(2)} solid {READY}; }}
QLabel {{ color: {QUIET}; background: transparent; font-size: {pt(10)}; }}
QLabel#brand {{ color: {INK}; font-size: {pt(17)}; font-weight: 700; }}
QLabel#heading {{ color: {INK}; font-size: {pt(15)}; font-weight: 600; }}
QLabel#subheading {{ color: {INK}; font-size: {pt(11)}; font-weight: 600; }}
QLabel#body {{ color: {INK}; font-size: {pt(10.5)}; }}
QLabel#verdict {{ color: {INK}; font-size: {pt(22)}; font-weight: 700; }}
QLabel#verdict[passed="true"] {{ color: {READY}; }}
QLabel#verdict[passed="false"] {{ color: {CAUTION}; }}
QLabel#figure {{ color: {INK}; font-size: {pt(10)}; font-weight: 400; }}
QLabel#alarm {{ color: {ALARM}; font-size: {pt(10.5)}; font-weight: 600; }}
QLabel#problem {{
    color: {INK}; background: {PANEL}; border: {px(2)} solid {CAUTION};
    border-radius: {px(4)}; padding: {px(8)}; font-size: {pt(10.5)};
}}
QPushButton {{
    color: {INK}; background: {PANEL}; border: 1px solid {QUIET};
    border-radius: {px(4)}; padding: {px(6)} {px(12)}; font-size: {pt(10.5)};
}}
QPushButton:hover {{ border-color: {INK}; }}
QPushButton:focus {{ border: {px(2)} solid {READY}; }}
QPushButton:disabled {{ color: {QUIET}; border-color: {EDGE}; }}
QPushButton#primary {{ background: {READY}; color: {BACKGROUND}; font-weight: 700; }}
QPushButton#primary:focus {{ border: {px(2)} solid {INK}; }}
QPushButton#primary:disabled {{ background: {EDGE}; color: {QUIET}; }}
QComboBox, QLineEdit {{
    color: {INK}; background: {PANEL}; border: 1px solid {QUIET};
    border-radius: {px(4)}; padding: {px(4)} {px(8)}; font-size: {pt(10.5)};
}}
QComboBox:focus, QLineEdit:focus {{ border: {px(2)} solid {READY}; }}
QComboBox QLineEdit, QComboBox QLineEdit:focus {{ border: none; padding: 0; }}
QComboBox QAbstractItemView {{
    color: {INK}; background: {PANEL}; selection-background-color: {EDGE};
    selection-color: {INK};
}}
QTreeWidget {{
    color: {INK}; background: {PANEL}; border: 1px solid {EDGE};
    font-size: {pt(10.5)};
}}
QTreeWidget:focus {{ border: 1px solid {READY}; }}
QTreeWidget::item {{ padding: {px(4)} {px(4)}; border: none; }}
QTreeWidget::item:selected {{ background: {EDGE}; color: {INK}; }}
QHeaderView::section {{
    color: {QUIET}; background: {PANEL}; border: none; padding: {px(4)};
    font-size: {pt(9.5)};
}}
QScrollArea {{ border: none; background: transparent; }}
QWidget#scrolled {{ background: transparent; }}
QProgressBar {{
    background: {EDGE}; border: none; max-height: {px(6)}; min-height: {px(6)};
}}
QProgressBar::chunk {{ background: {READY}; }}
QScrollBar:vertical {{ background: {PANEL}; width: {px(10)}; }}
QScrollBar::handle:vertical {{ background: {QUIET}; min-height: {px(20)}; }}
QScrollBar::add-line, QScrollBar::sub-line {{ height: 0; }}
"""
