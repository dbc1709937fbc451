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
    drop_down_rules,
)


def page_sheet(scale: float) -> str:
    """Return the rules; scale: on every length."""

    def pt(size: float) -> str:
        return f"{size * scale:.1f}pt"

    def px(size: float) -> str:
        return f"{max(round(size * scale), 1)}px"

    ground, panel, edge = BACKGROUND.name(), PANEL.name(), EDGE.name()
    ink, quiet, ready = INK.name(), QUIET.name(), READY.name()
    caution, alarm = CAUTION.name(), ALARM.name()
    return f"""
QWidget#page {{ background: {ground}; }}
QFrame#card {{
    background: {panel}; border: 1px solid {edge}; border-radius: {px(6)};
}}
QFrame#card[marked="true"] {{ border: {px(2)} solid {ready}; }}
QLabel {{ color: {quiet}; background: transparent; font-size: {pt(10)}; }}
QLabel#brand {{ color: {ink}; font-size: {pt(17)}; font-weight: 700; }}
QLabel#heading {{ color: {ink}; font-size: {pt(15)}; font-weight: 600; }}
QLabel#subheading {{ color: {ink}; font-size: {pt(11)}; font-weight: 600; }}
QLabel#body {{ color: {ink}; font-size: {pt(10.5)}; }}
QLabel#verdict {{ color: {ink}; font-size: {pt(22)}; font-weight: 700; }}
QLabel#verdict[passed="true"] {{ color: {ready}; }}
QLabel#verdict[passed="false"] {{ color: {caution}; }}
QLabel#figure {{ color: {ink}; font-size: {pt(10)}; font-weight: 400; }}
QLabel#alarm {{ color: {alarm}; font-size: {pt(10.5)}; font-weight: 600; }}
QLabel#problem {{
    color: {ink}; background: {panel}; border: {px(2)} solid {caution};
    border-radius: {px(4)}; padding: {px(8)}; font-size: {pt(10.5)};
}}
QPushButton {{
    color: {ink}; background: {panel}; border: 1px solid {quiet};
    border-radius: {px(4)}; padding: {px(6)} {px(12)}; font-size: {pt(10.5)};
}}
QPushButton:hover {{ border-color: {ink}; }}
QPushButton:focus {{ border: {px(2)} solid {ready}; }}
QPushButton:disabled {{ color: {quiet}; border-color: {edge}; }}
QPushButton#primary {{ background: {ready}; color: {ground}; font-weight: 700; }}
QPushButton#primary:focus {{ border: {px(2)} solid {ink}; }}
QPushButton#primary:disabled {{ background: {edge}; color: {quiet}; }}
QComboBox, QLineEdit {{
    color: {ink}; background: {panel}; border: 1px solid {quiet};
    border-radius: {px(4)}; padding: {px(4)} {px(8)}; font-size: {pt(10.5)};
}}
QComboBox:focus, QLineEdit:focus {{ border: {px(2)} solid {ready}; }}
QComboBox QLineEdit, QComboBox QLineEdit:focus {{ border: none; padding: 0; }}
QComboBox QAbstractItemView {{
    color: {ink}; background: {panel}; selection-background-color: {edge};
    selection-color: {ink};
}}
QCheckBox {{ color: {ink}; font-size: {pt(10)}; }}
QPlainTextEdit {{
    color: {ink}; background: {panel}; border: 1px solid {edge};
    font-size: {pt(10.5)};
}}
QPlainTextEdit:focus {{ border: 1px solid {ready}; }}
QTreeWidget {{
    color: {ink}; background: {panel}; border: 1px solid {edge};
    font-size: {pt(10.5)};
}}
QTreeWidget:focus {{ border: 1px solid {ready}; }}
QTreeWidget::item {{ padding: {px(4)} {px(4)}; border: none; }}
QTreeWidget::item:selected {{ background: {edge}; color: {ink}; }}
QHeaderView::section {{
    color: {quiet}; background: {panel}; border: none; padding: {px(4)};
    font-size: {pt(9.5)};
}}
QScrollArea {{ border: none; background: transparent; }}
QWidget#scrolled {{ background: transparent; }}
QProgressBar {{
    background: {edge}; border: none; max-height: {px(6)}; min-height: {px(6)};
}}
QProgressBar::chunk {{ background: {ready}; }}
QSlider {{ min-height: {px(18)}; }}
QSlider::groove:horizontal {{
    background: {edge}; height: {px(4)}; border-radius: {px(2)};
}}
QSlider::sub-page:horizontal {{ background: {ready}; border-radius: {px(2)}; }}
QSlider::sub-page:horizontal:disabled {{ background: {quiet}; }}
QSlider::handle:horizontal {{
    background: {ink}; width: {px(14)}; margin: -{px(5)} 0; border-radius: {px(6)};
}}
QSlider::handle:horizontal:disabled {{ background: {quiet}; }}
QSlider::handle:horizontal:focus {{ border: {px(2)} solid {ready}; }}
QScrollBar:vertical {{ background: {panel}; width: {px(10)}; }}
QScrollBar::handle:vertical {{ background: {quiet}; min-height: {px(20)}; }}
QScrollBar::add-line, QScrollBar::sub-line {{ height: 0; }}
""" + drop_down_rules(scale)
