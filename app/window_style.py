"""The window's colours: dark, because the picture is what one looks at."""

BACKGROUND = "#0d1117"
PANEL = "#161b22"
EDGE = "#262c34"
INK = "#f0f3f6"
QUIET = "#9aa4af"
READY = "#4cc9a0"
ALARM = "#ff4d5e"

STYLE_SHEET = f"""
QMainWindow, QWidget#side {{ background: {BACKGROUND}; }}
QWidget#gauges {{ background: {PANEL}; border-top: 1px solid {EDGE}; }}
QLabel {{ color: {QUIET}; background: transparent; }}
QLabel#title {{ color: {INK}; font-size: 15pt; font-weight: 600; }}
QLabel#caption {{ color: {QUIET}; font-size: 9pt; }}
QLabel#figure {{ color: {INK}; font-size: 17pt; font-weight: 600; }}
QLabel#figure[alarming="true"] {{ color: {ALARM}; }}
QLabel#key {{ color: {INK}; padding-right: 10px; }}
"""
