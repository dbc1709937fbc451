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
    Pixels,
    controls_sheet,
)


def page_sheet(scale: float) -> str:
    """Return the rules of a page of text; scale: on every length."""

    def pt(size: float) -> str:
        return f"{size * scale:.1f}pt"

    ink, quiet, ready = INK.name(), QUIET.name(), READY.name()
    ground, edge, px = BACKGROUND.name(), EDGE.name(), Pixels(scale)
    return f"""
QWidget#page {{ background: {ground}; }}
QFrame#card {{
    background: {PANEL.name()}; border: 1px solid {edge}; border-radius: {px(6)};
}}
QFrame#card[marked="true"] {{ border: {px(2)} solid {ready}; }}
QLabel {{ color: {quiet}; background: transparent; font-size: {pt(10)}; }}
QLabel#brand {{ color: {ink}; font-size: {pt(17)}; font-weight: 700; }}
QLabel#heading {{ color: {ink}; font-size: {pt(15)}; font-weight: 600; }}
QLabel#subheading {{ color: {ink}; font-size: {pt(11)}; font-weight: 600; }}
QLabel#body {{ color: {ink}; font-size: {pt(10.5)}; }}
QLabel#verdict {{ color: {ink}; font-size: {pt(22)}; font-weight: 700; }}
QLabel#verdict[passed="true"] {{ color: {ready}; }}
QLabel#verdict[passed="false"] {{ color: {CAUTION.name()}; }}
QLabel#figure {{ color: {ink}; font-size: {pt(10)}; font-weight: 400; }}
QLabel#alarm {{ color: {ALARM.name()}; font-size: {pt(10.5)}; font-weight: 600; }}
QPlainTextEdit {{
    color: {ink}; background: {PANEL.name()}; border: 1px solid {edge};
    font-size: {pt(10.5)};
}}
QPlainTextEdit:focus {{ border: 1px solid {ready}; }}
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
""" + controls_sheet(scale, points=10.5, room=6)


def replay_sheet(scale: float) -> str:
    """Return the rules of a replay: what a flight has, with small buttons and lists."""
    ink = INK.name()
    return f"""
QLabel#clock {{ color: {ink}; font-size: {11 * scale:.1f}pt; font-weight: 600; }}
""" + controls_sheet(scale, points=9.5, room=3)
